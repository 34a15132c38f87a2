"""Compute intervals of an extended model's parameters and shapes.

They remain valid with autocorrelated noise and small model error.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.stats import chi2, norm

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.evidence.slow_error import slow_error
from pipelines.diagnosis.fit.change_point import ALIKE_S
from pipelines.diagnosis.fit.joint_fit import (
    Fit,
    onsets_of,
    slope,
    stacked_columns,
    with_loads_of,
)
from pipelines.estimation.long_run import long_run_covariance
from pipelines.estimation.sandwich import sandwich


@dataclass(frozen=True)
class Uncertainty:
    """Joint covariance of the linear values and the free shapes."""

    covariance: NDArray
    critical: float
    shapes: tuple[tuple[int, int, int], ...]
    """(cause, shape parameter, run) of each shape after the linear values; run -1 where shared.
    First those that are fitted, then those that were chosen among forms."""
    normal: NDArray
    """Weighted normal matrix of the same parameters in the same order, from which collinearity is
    computed."""
    onsets: Mapping[tuple[int, int, int], tuple[float, float]] = field(default_factory=dict)
    """The ends of the 95 % interval of each shape that is an onset, s."""

    def includes_zero(self, values: NDArray, amplitudes: slice) -> bool:
        """Return whether the joint 95 % region of some amplitudes includes zero (Wald's test).

        Parameters
        ----------
        values : (p,) array
            Linear values of the fit.
        amplitudes : slice
            Places of the amplitudes among them.

        Returns
        -------
        bool
            False without amplitudes.
        """
        size, covariance = values[amplitudes], self.covariance[amplitudes, amplitudes]
        statistic = float(size @ np.linalg.pinv(covariance, hermitian=True) @ size)
        # Few effective samples widen the region as they widen each interval.
        inflation = (self.critical / norm.ppf(0.975)) ** 2
        return len(size) > 0 and statistic <= inflation * float(chi2.ppf(0.95, len(size)))


def uncertainty(
    fit: Fit, runs: Sequence[Run], baseline: Baseline, imperfect: NDArray
) -> Uncertainty:
    """Return the covariance of a fit, linearised in its columns and its free shapes.

    Two errors add: noise, and model error. Model error is the remaining slow error, at least
    ``imperfect``. It is small, but it is correlated over half a second and repeats in every period,
    so more data do not average it out. Shapes that are held at a default may be anywhere in their
    typical range. A shape that was chosen among a few forms, as an exponent, may lie between them:
    data and typical range give its distance from the form. An onset is known so much better than
    the size of its effect that neither widens the other.

    Parameters
    ----------
    fit : Fit
    runs : sequence of Run
    baseline : Baseline
    imperfect : (O,) array
        Error that every model of a good rig has, N·m rms.

    Returns
    -------
    Uncertainty
    """
    runs = with_loads_of(runs, fit, baseline)
    plain = stacked_columns(fit.causes, runs, baseline)
    columns = [c for c, _ in plain]
    residuals = [y - c @ fit.values for c, y in plain]
    forms = _forms(fit.causes)
    places = [*_shapes(fit.causes, len(runs), fitted=True), *forms]
    slopes = [slope(fit, place, runs, baseline, plain) for place in places]
    wide = [
        np.concatenate([c, *(s[r][:, :, np.newaxis] for s in slopes)], axis=2)
        for r, c in enumerate(columns)
    ]
    # Sandwich: curvature of the fit outside, and the variance of its scores inside.
    weights = fit.weights
    gram = sum(
        np.einsum("mo,o,moi,moj->ij", run.usable, weights, a, a)
        for run, a in zip(runs, wide, strict=True)
    )
    scores = [
        np.einsum("mo,o,mo,moi->mi", run.usable, weights, e, a)
        for run, e, a in zip(runs, residuals, wide, strict=True)
    ]
    # First noise: correlated scores, each run a stretch of its own.
    filling, critical, _ = long_run_covariance(lambda: enumerate(scores), gram.shape[0])
    # Then model error: it is the same in many blocks, so their number multiplies its variance.
    misfit = np.maximum(imperfect, slow_error(runs, residuals).excess)
    for run, a in zip(runs, wide, strict=True):
        filling = filling + np.einsum(
            "mo,o,moi,moj->ij", run.usable, _correlated_blocks(run) * (weights * misfit) ** 2, a, a
        )
    for place in _shapes(fit.causes, len(runs), fitted=False):
        # Held shapes: uniform over the typical range, whose variance is its square over 12.
        low, high = fit.causes[place[0]].effect.shape[place[1]].typical
        assumed = slope(fit, place, runs, baseline, plain)
        pull = sum(
            np.einsum("mo,o,moi,mo->i", run.usable, weights, a, s)
            for run, a, s in zip(runs, wide, assumed, strict=True)
        )
        filling = filling + np.outer(pull, pull) * (high - low) ** 2 / 12.0
    for at, (number, i, _) in enumerate(forms, start=len(gram) - len(forms)):
        # Forms: the typical range is prior information, which counts as an observation would.
        low, high = fit.causes[number].effect.shape[i].typical
        gram[at, at] += 12.0 / (high - low) ** 2
        filling[at, at] += 12.0 / (high - low) ** 2
    inverse = np.linalg.pinv(gram, rcond=1e-13, hermitian=True)
    covariance = sandwich(inverse, filling)
    # An effect's own approximations remain, however many data there are.
    for at, (number, i, r) in enumerate(places, start=len(fit.values)):
        if i == 0:
            cause = fit.causes[number]
            covariance[at, at] += (cause.effect.known_to * cause.shapes[max(r, 0)][0]) ** 2
    # An onset gets the variance that gives its interval with the same critical value.
    onsets = _onsets(fit, runs, baseline, misfit)
    return Uncertainty(
        block_diag(
            covariance, *(((high - low) / (2.0 * critical)) ** 2 for low, high in onsets.values())
        ),
        critical,
        (*places, *onsets),
        block_diag(gram, np.zeros((len(onsets), len(onsets)))),
        onsets,
    )


def _correlated_blocks(run: Run) -> float:
    """Return the number of blocks with the same model error.

    They are neighbours within ``ALIKE_S``, once a period.
    """
    seconds = len(run.time) / run.blocks_in(1.0)
    # Time after which a motion without a period is assumed to pass through the same states again,
    # s.
    recurrence_s = 10.0
    return run.blocks_in(ALIKE_S) * max(seconds / (run.motion.period_s or recurrence_s), 1.0)


def _onsets(
    fit: Fit, runs: Sequence[Run], baseline: Baseline, misfit: NDArray
) -> dict[tuple[int, int, int], tuple[float, float]]:
    """Return the interval of each cause's onset, by (cause, shape parameter, run)."""
    ends: dict[tuple[int, int, int], tuple[float, float]] = {}
    for number, cause in enumerate(fit.causes):
        i = cause.onset
        if i is not None:
            onsets = onsets_of(fit, number, i, runs, baseline)
            ends |= {
                (number, i, r): onsets[r].interval(runs[r], misfit)
                for r in fit.columns_of(number).runs
            }
    return ends


def _forms(causes: Sequence[Candidate]) -> list[tuple[int, int, int]]:
    """Return shapes that were chosen among forms and could lie between them.

    Each is (cause, shape parameter, -1). Where no value is negative, zero stands for a form without
    the parameter.
    """
    return [
        (number, i, -1)
        for number, cause in enumerate(causes)
        for i, parameter in enumerate(cause.effect.shape)
        if len(parameter.forms) > 1
        and parameter.between_forms
        and (cause.shapes[0][i] > 0.0 or parameter.typical[0] < 0.0)
    ]


def _shapes(causes: Sequence[Candidate], runs: int, fitted: bool) -> list[tuple[int, int, int]]:
    """Return shapes other than onsets that are fitted, or not.

    Each is (cause, shape parameter, run), run -1 where all share it.
    """
    return [
        (number, i, run)
        for number, cause in enumerate(causes)
        for i, parameter in enumerate(cause.effect.shape)
        if cause.is_free(i) == fitted
        and not parameter.forms
        and i != cause.onset
        # Ends of the motion are known.
        and not parameter.swept_end
        for run in (range(runs) if parameter.per_run else (-1,))
    ]
