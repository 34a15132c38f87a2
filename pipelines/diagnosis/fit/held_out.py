"""Compute a model's residuals on runs that its fit has not seen.

Shared parameters come from training. Per-run parameters (an onset, a phase, a zero set at each
start) are fitted to each validation run: on one half of its seconds to be scored on the other, and
the other way round.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import ALWAYS, NEVER, Candidate
from pipelines.diagnosis.candidates.shape_refinement import reach
from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.baseline_columns import columns_under
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.change_point import Onset
from pipelines.diagnosis.fit.joint_fit import Fit, step_of, with_loads_of
from pipelines.model import Model, Term


def held_out_residuals(fit: Fit, runs: Sequence[Run], baseline: Baseline) -> list[NDArray]:
    """Return the residuals of runs under a model fitted to other runs.

    Parameters
    ----------
    fit : Fit
    runs : sequence of Run
    baseline : Baseline

    Returns
    -------
    list of (m, O) arrays
        Measured less predicted torque, N·m.
    """
    return [_residual(fit, run, baseline) for run in with_loads_of(runs, fit, baseline)]


def _residual(fit: Fit, run: Run, baseline: Baseline) -> NDArray:
    effects = [cause.effect for cause in fit.causes]
    if not any(effect.per_run and effect.explains(run.motion) for effect in effects):
        columns, measured = columns_under([_shared_term(c) for c in fit.causes], run, baseline)
        return measured - columns @ fit.layout.select(fit.values, None)
    half = halves(run)
    residual = np.zeros_like(run.measured)
    for side in (0, 1):
        scored = half == side
        used = run.usable & ~scored[:, np.newaxis]
        residual[scored] = _fit_own_values(fit, run, baseline, used)[1][scored]
    return residual


def halves(run: Run) -> NDArray:
    """Assign the blocks to two halves, 0 and 1, second by second, in Thue and Morse's order.

    No rhythm shares that order. An onset is known to about a second.

    Parameters
    ----------
    run : Run
        m blocks.

    Returns
    -------
    (m,) int array
    """
    # Length of the stretches of a run that alternate between the two halves, s.
    stretch_s = 1.0
    return np.bitwise_count(np.floor((run.time - run.time[0]) / stretch_s).astype(np.int64)) % 2


def _shared_term(cause: Candidate) -> Term:
    # A shape that runs share is equal in all of them; per-run ones are fitted to this run.
    return cause.term(0)


def terms_with_own_values(fit: Fit, run: Run, baseline: Baseline) -> list[Term]:
    """Return the causes as terms of a run's model with its own onsets and phases."""
    values, _, terms = _fit_own_values(
        fit, with_loads_of([run], fit, baseline)[0], baseline, run.usable
    )
    return list(Model(tuple(terms)).with_linear(values[baseline.size :])) if terms else []


OwnFit = tuple[NDArray, NDArray, list[Term]]
"""Values, residual (m, O), and the terms with a run's own onsets."""


def _fit_own_values(fit: Fit, run: Run, baseline: Baseline, used: NDArray) -> OwnFit:
    """Fit the run's own onsets, phases and shapes to the samples ``used``, (m, O) bool."""
    begins = [
        (number, i) for number, cause in enumerate(fit.causes) if (i := cause.onset) is not None
    ]
    # Without any onset first: an instant of another run would bias the other values.
    terms = [_shared_term(cause) for cause in fit.causes]
    for place in begins:
        terms = _with_shape(terms, *place, NEVER)
    own_fit = _fit_amplitudes(fit, terms, run, baseline, used)
    # Onsets are sought twice, because each is found with the others held.
    for _ in range(2 if begins else 0):
        for place in begins:
            instant = _onset_of(fit, own_fit, place, run, baseline, used)
            own_fit = _fit_amplitudes(
                fit, _with_shape(own_fit[2], *place, instant), run, baseline, used
            )
    return own_fit


def _onset_of(
    fit: Fit, own_fit: OwnFit, place: tuple[int, int], run: Run, baseline: Baseline, used: NDArray
) -> float:
    """Return the instant (s) at which a cause begins, all else held."""
    values, _, terms = own_fit
    ends = [
        columns_under(_with_shape(terms, *place, end), run, baseline) for end in (NEVER, ALWAYS)
    ]
    without, throughout = (measured - columns @ values for columns, measured in ends)
    return Onset.of(run, without, throughout, used, fit.weights).likeliest


def _fit_amplitudes(
    fit: Fit, terms: list[Term], run: Run, baseline: Baseline, used: NDArray
) -> OwnFit:
    """Fit the run's own amplitudes and shapes to the samples ``used``, (m, O)."""
    shared, own = fit.layout.select(fit.values, None), fit.layout.per_run
    shaped, (columns, measured) = _fit_shapes(
        fit, terms, run, baseline, columns_under(terms, run, baseline), used
    )
    # Only the run's own amplitudes are fitted, or it would be no validation of the shared ones.
    values = shared.copy()
    values[own] = _solved(columns[:, :, own], measured - columns @ shared, used, fit.weights)
    return values, measured - columns @ values, shaped


def _fit_shapes(
    fit: Fit,
    terms: list[Term],
    run: Run,
    baseline: Baseline,
    plain: tuple[NDArray, NDArray],
    used: NDArray,
) -> tuple[list[Term], tuple[NDArray, NDArray]]:
    """Fit per-run shapes that transform the motion to the samples ``used``, (m, O).

    Return the terms, and the columns under them, after steps of Gauss and Newton; ``plain`` are the
    columns and torques under the terms as given.
    """
    shared, own = fit.layout.select(fit.values, None), fit.layout.per_run
    places = [
        (number, i)
        for number, cause in enumerate(fit.causes)
        if (i := cause.per_run_transform) is not None
    ]
    # Along per-run shapes the torque is nearly linear, so three steps suffice.
    for _ in range(3 if places else 0):
        columns, measured = plain
        slopes = [_slope(fit, terms, place, shared, run, baseline, plain) for place in places]
        # Own amplitudes move with the shapes, or shapes would make up for their errors.
        wide = np.concatenate([columns[:, :, own], *slopes], axis=2)
        steps = _solved(wide, measured - columns @ shared, used, fit.weights)[int(own.sum()) :]
        for (number, i), step in zip(places, steps, strict=True):
            value = float(
                np.clip(terms[number].shape[i] + step, *reach(fit.causes[number].effect.shape[i]))
            )
            terms = _with_shape(terms, number, i, value)
        plain = columns_under(terms, run, baseline)
    return terms, plain


def _solved(columns: NDArray, target: NDArray, used: NDArray, weights: NDArray) -> NDArray:
    """Return the amplitudes (k,) of columns (m, O, k) that fit a target (m, O) where ``used``."""
    root = np.sqrt(weights) * used
    A = (columns * root[:, :, np.newaxis]).reshape(root.size, columns.shape[2])
    # A column is zero where its effect never acts: the least norm makes its amplitude zero.
    return np.asarray(np.linalg.lstsq(A, (target * root).ravel(), rcond=1e-9)[0])


def _slope(
    fit: Fit,
    terms: list[Term],
    place: tuple[int, int],
    values: NDArray,
    run: Run,
    baseline: Baseline,
    plain: tuple[NDArray, NDArray],
) -> NDArray:
    """Return the column (m, O, 1) of a shape of one term, as ``joint_fit.slope`` of all runs."""
    number, i = place
    step = step_of(fit.causes[number], i)
    ahead, read = columns_under(
        _with_shape(terms, number, i, terms[number].shape[i] + step), run, baseline
    )
    columns, measured = plain
    return (((ahead @ values - read) - (columns @ values - measured)) / step)[:, :, np.newaxis]


def _with_shape(terms: list[Term], number: int, i: int, value: float) -> list[Term]:
    """Return the terms with a new shape of one of them."""
    return [term.with_shape(i, value) if k == number else term for k, term in enumerate(terms)]
