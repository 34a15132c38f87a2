"""What a model leaves of the validation runs, which no fit has seen.

Shared parameters come from training. What is tied to wall time, an onset or a phase, each validation run
fits for itself: on odd periods to be scored on even ones, and the other way round.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate, columns_under
from pipelines.diagnosis.fit import Fit, laden
from pipelines.diagnosis.observations import Baseline, Run
from pipelines.diagnosis.scan import ALWAYS, NEVER, ONSETS
from pipelines.model import Term

WITHOUT_INSTANT = 2
"""How many of the onsets tried, the first ones, are no instant within the run."""
ALIKE = 4.0
"""Weighted squared error within which two onsets explain a run alike."""


def evaluate(fit: Fit, runs: Sequence[Run], baseline: Baseline) -> list[NDArray]:
    """Return the residuals (m, O) of each run under a model fitted elsewhere."""
    return [_residual(fit, run, baseline) for run in laden(runs, fit, baseline)]


def _residual(fit: Fit, run: Run, baseline: Baseline) -> NDArray:
    effects = [cause.effect for cause in fit.causes]
    if not any(effect.per_run and effect.explains(run.motion) for effect in effects):
        columns, measured = columns_under([_shared_term(c) for c in fit.causes], run, baseline)
        return measured - columns @ _shared_values(fit, baseline)[0]
    left = np.zeros_like(run.measured)
    half = _halves(run)
    for side in (0, 1):
        learnt = run.usable & (half != side)[:, np.newaxis]
        left[half == side] = _own(fit, run, baseline, learnt)[half == side]
    return left


def _halves(run: Run) -> NDArray:
    """Deal the blocks out to two halves: odd and even periods, or stretches of a fold's length."""
    return run.fold % 2


def _shared_term(cause: Candidate) -> Term:
    return cause.term(0)


def _shared_values(fit: Fit, baseline: Baseline) -> tuple[NDArray, NDArray]:
    """Return the values in the order of one run's columns, and which of them a run has for itself."""
    values, own = list(fit.values[: baseline.size]), [False] * baseline.size
    at = baseline.size
    for cause in fit.causes:
        apart = cause.apart
        shared = [i for i, a in enumerate(apart) if not a]
        in_place = dict(zip(shared, fit.values[at : at + len(shared)], strict=True))
        values += [in_place.get(i, 0.0) for i in range(len(apart))]
        own += apart
        at += len(shared) + (len(apart) - len(shared)) * fit.acting(cause)
    return np.array(values), np.array(own, dtype=bool)


def settled(fit: Fit, run: Run, baseline: Baseline) -> tuple[list[Term], NDArray]:
    """Return the causes as terms of a run's model with its own onsets and phases, and the baseline's values."""
    values, _, terms = _learn(fit, laden([run], fit, baseline)[0], baseline, run.usable)
    at = baseline.size
    filled = []
    for term in terms:
        width = len(term.effect.linear)
        filled.append(replace(term, values=np.append(values[at : at + width], term.shape)))
        at += width
    return filled, values[: baseline.size]


def _own(fit: Fit, run: Run, baseline: Baseline, learnt: NDArray) -> NDArray:
    return _learn(fit, run, baseline, learnt)[1]


def _learn(fit: Fit, run: Run, baseline: Baseline, learnt: NDArray) -> tuple[NDArray, NDArray, list[Term]]:
    """Fit the run's own onsets and phases where ``learnt`` (m, O): values, residual (m, O), terms.

    Onsets that explain the learnt samples alike are as likely as one another, and the middle one is taken; but what
    was there all along, or never, needs no coincidence.
    """
    shared, own = _shared_values(fit, baseline)
    tried = []
    for terms in _onsets(fit, [_shared_term(c) for c in fit.causes], run):
        columns, measured = columns_under(terms, run, baseline)
        values = shared.copy()
        if own.any():
            root = np.sqrt(fit.weights) * learnt
            A = (columns[:, :, own] * root[:, :, np.newaxis]).reshape(-1, int(own.sum()))
            values[own] = np.linalg.lstsq(A, ((measured - columns @ shared) * root).ravel(), rcond=1e-9)[0]
        left = measured - columns @ values
        cost = float(np.sum(fit.weights * np.sum(np.where(learnt, left, 0.0) ** 2, axis=0)))
        tried.append((cost, values, left, terms))
    least = min(cost for cost, *_ in tried)
    alike = [number for number, entry in enumerate(tried) if entry[0] < least + ALIKE]
    simple = [number for number in alike if number < WITHOUT_INSTANT]
    return tried[simple[0] if simple else alike[len(alike) // 2]][1:]


def _onsets(fit: Fit, terms: list[Term], run: Run) -> Iterator[list[Term]]:
    """Yield the terms with each onset that the run may have, first those that no instant is needed for."""
    dated = [
        (number, len(cause.effect.linear) + i)
        for number, cause in enumerate(fit.causes)
        for i, parameter in enumerate(cause.effect.shape)
        if parameter.per_run
    ]
    if not dated:
        yield terms
        return
    number, at = dated[0]
    for instant in (NEVER, ALWAYS, *np.linspace(run.time[0], run.time[-1], ONSETS + 2)[1:-1]):
        values = terms[number].values.copy()
        values[at] = instant
        yield [replace(t, values=values) if k == number else t for k, t in enumerate(terms)]
