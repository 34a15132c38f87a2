"""What a model leaves of the validation runs, which no fit has seen.

Shared parameters come from training. What is tied to wall time, an onset or a phase, each validation run
fits for itself: on odd seconds to be scored on even ones, and the other way round.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate, columns_under
from pipelines.diagnosis.fit import Fit, laden
from pipelines.diagnosis.observations import Baseline, Run
from pipelines.diagnosis.scan import ALWAYS, NEVER, ONSETS
from pipelines.model import Term

STRETCH_S = 1.0
"""Of every second stretch a run's own onsets and phases are learnt, to be scored on the others."""
FINER = 9
"""Instants tried about the best onset of the first search."""
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
    """Deal the blocks out to two halves, second by second: an onset is as well known as that."""
    return np.floor(run.time / STRETCH_S).astype(int) % 2


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
    terms = [_shared_term(cause) for cause in fit.causes]
    dated = _onset(fit)
    if dated is None:
        return _learn_amplitudes(fit, terms, run, baseline, learnt)[1:]

    def learn_from(instant: float) -> tuple[float, NDArray, NDArray, list[Term]]:
        return _learn_amplitudes(fit, _beginning(terms, *dated, instant), run, baseline, learnt)

    simple = [learn_from(instant) for instant in (NEVER, ALWAYS)]
    instants = np.linspace(run.time[0], run.time[-1], ONSETS + 2)[1:-1]
    dating = {instant: learn_from(instant) for instant in instants}
    best = min(dating, key=lambda instant: dating[instant][0])
    apart = instants[1] - instants[0]
    dating |= {instant: learn_from(instant) for instant in best + apart * np.linspace(-1.0, 1.0, FINER)}
    alike = min(entry[0] for entry in (*simple, *dating.values())) + ALIKE
    likely = [entry for entry in simple if entry[0] < alike][:1]
    likely = likely or [dating[instant] for instant in sorted(dating) if dating[instant][0] < alike]
    return likely[len(likely) // 2][1:]


def _learn_amplitudes(
    fit: Fit, terms: list[Term], run: Run, baseline: Baseline, learnt: NDArray
) -> tuple[float, NDArray, NDArray, list[Term]]:
    """Fit the run's own amplitudes to terms of given shapes: squared error, values, residual (m, O), terms."""
    shared, own = _shared_values(fit, baseline)
    columns, measured = columns_under(terms, run, baseline)
    values = shared.copy()
    if own.any():
        root = np.sqrt(fit.weights) * learnt
        A = (columns[:, :, own] * root[:, :, np.newaxis]).reshape(-1, int(own.sum()))
        values[own] = np.linalg.lstsq(A, ((measured - columns @ shared) * root).ravel(), rcond=1e-9)[0]
    left = measured - columns @ values
    squares = float(np.sum(fit.weights * np.sum(np.where(learnt, left, 0.0) ** 2, axis=0)))
    return squares, values, left, terms


def _onset(fit: Fit) -> tuple[int, int] | None:
    """Return which cause has an onset of its own in each run, and its place among the cause's values, if any has."""
    for number, cause in enumerate(fit.causes):
        for i, parameter in enumerate(cause.effect.shape):
            if parameter.per_run:
                return number, len(cause.effect.linear) + i
    return None


def _beginning(terms: list[Term], number: int, at: int, instant: float) -> list[Term]:
    """Return the terms with one that begins at an instant."""
    values = terms[number].values.copy()
    values[at] = instant
    return [replace(t, values=values) if k == number else t for k, t in enumerate(terms)]
