"""What a model leaves of the validation runs, which no fit has seen.

Shared parameters come from training. What is tied to wall time, an onset or a phase, each validation run
fits for itself: on odd periods to be scored on even ones, and the other way round.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate, columns_under
from pipelines.diagnosis.fit import Fit
from pipelines.diagnosis.observations import Baseline, Run
from pipelines.diagnosis.scan import NEVER, ONSETS


def evaluate(fit: Fit, runs: Sequence[Run], baseline: Baseline) -> list[NDArray]:
    """Return the residuals (m, O) of each run under a model fitted elsewhere."""
    return [_residual(fit, run, baseline) for run in runs]


def _residual(fit: Fit, run: Run, baseline: Baseline) -> NDArray:
    effects = [cause.effect for cause in fit.causes]
    if not any(p.per_run for e in effects for p in e.fitted if e.explains(run.motion)):
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


def _shared_term(cause: Candidate):
    return cause.term(0)


def _shared_values(fit: Fit, baseline: Baseline) -> tuple[NDArray, NDArray]:
    """Return the values in the order of one run's columns, and which of them a run has for itself."""
    values, own = list(fit.values[: baseline.size]), [False] * baseline.size
    at = baseline.size
    for cause in fit.causes:
        apart = [] if cause.bends else [p.per_run for p in cause.effect.linear]
        shared = [i for i, a in enumerate(apart) if not a]
        in_place = dict(zip(shared, fit.values[at : at + len(shared)], strict=True))
        values += [in_place.get(i, 0.0) for i in range(len(apart))]
        own += list(apart)
        at += len(shared) + (len(apart) - len(shared)) * fit.acting(cause)
    return np.array(values), np.array(own, dtype=bool)


def _own(fit: Fit, run: Run, baseline: Baseline, learnt: NDArray) -> NDArray:
    """Return the run's residual with its own onsets and phases fitted where ``learnt`` (m, O)."""
    values, own = _shared_values(fit, baseline)
    terms = [_shared_term(c) for c in fit.causes]
    best, least = None, np.inf
    for tried in _onsets(fit, terms, run):
        columns, measured = columns_under(tried, run, baseline)
        left = measured - columns @ values
        if own.any():
            root = np.sqrt(fit.weights) * learnt
            A = (columns[:, :, own] * root[:, :, np.newaxis]).reshape(-1, int(own.sum()))
            phases = np.linalg.lstsq(A, (left * root).ravel(), rcond=1e-9)[0]
            left = left - columns[:, :, own] @ phases
        cost = float(np.sum(fit.weights * np.sum(np.where(learnt, left, 0.0) ** 2, axis=0)))
        if cost < least:
            best, least = left, cost
    assert best is not None
    return best


def _onsets(fit: Fit, terms: list, run: Run):
    """Yield the terms with each onset that the run may have, never among them."""
    yield_as_is = True
    for number, cause in enumerate(fit.causes):
        at = [i for i, p in enumerate(cause.effect.shape) if p.per_run]
        if not at:
            continue
        yield_as_is = False
        first = len(cause.effect.linear) + at[0]
        instants = [NEVER, *np.linspace(run.time[0], run.time[-1], ONSETS + 2)[1:-1]]
        for instant in instants:
            changed = terms[number].values.copy()
            changed[first] = instant
            yield [replace(t, values=changed) if k == number else t for k, t in enumerate(terms)]
    if yield_as_is:
        yield terms
