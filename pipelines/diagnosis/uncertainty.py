"""Intervals of an extended model's parameters, shapes included, that survive autocorrelation and small misfit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate
from pipelines.diagnosis.fit import Fit, laden, stacked_columns
from pipelines.diagnosis.observations import Baseline, Run
from pipelines.estimation.least_squares import long_run_covariance

ALIKE_S = 0.5
"""How long what a model gets wrong stays alike: it goes with the motion, whose fastest parts are about 1 Hz."""
STEP = 0.01
"""Of a difference along a shape parameter, as a share of its typical range."""


@dataclass(frozen=True)
class Uncertainty:
    """Joint covariance of the linear values and the free shapes."""

    covariance: NDArray
    critical: float
    shapes: tuple[tuple[int, int, int], ...]
    """(cause, shape parameter, run) behind each shape's place after the linear values; run -1 where shared."""


def uncertainty(fit: Fit, runs: Sequence[Run], baseline: Baseline, imperfect: NDArray) -> Uncertainty:
    """Linearise about a fit: its columns, and what a step in each free shape does to the prediction.

    Beside the noise stands what no model of a good rig gets right, ``imperfect`` (O,) N·m rms: small against the
    noise, but much alike from sample to sample, and so the larger part of what hours of data leave in doubt.
    """
    runs = laden(runs, fit, baseline)
    plain = stacked_columns(fit.causes, runs, baseline)
    columns = [c for c, _ in plain]
    left = [y - c @ fit.values for c, y in plain]
    places, slopes = [], []
    for cause, i, run in _free_shapes(fit.causes, len(runs)):
        moved, step = _moved(fit.causes, cause, i, run)
        ahead = stacked_columns(moved, runs, baseline)
        slopes.append([((c @ fit.values - y) - (d @ fit.values - z)) / step
                       for (c, y), (d, z) in zip(ahead, plain, strict=True)])  # fmt: skip
        places.append((cause, i, run))
    wide = [np.concatenate([c, *(s[r][:, :, np.newaxis] for s in slopes)], axis=2) for r, c in enumerate(columns)]
    weights = fit.weights
    gram = sum(np.einsum("mo,o,moi,moj->ij", run.usable, weights, a, a) for run, a in zip(runs, wide, strict=True))
    scores = [
        np.einsum("mo,o,mo,moi->mi", run.usable, weights, e, a) for run, e, a in zip(runs, left, wide, strict=True)
    ]
    filling, critical = long_run_covariance([[s] for s in scores], gram.shape[0])
    for observed, a in zip(runs, wide, strict=True):
        alike = ALIKE_S * observed.motion.sample_rate_hz / observed.block.decimation
        filling = filling + np.einsum("mo,o,moi,moj->ij", observed.usable, alike * (weights * imperfect) ** 2, a, a)
    inverse = np.linalg.pinv(gram, rcond=1e-13, hermitian=True)
    return Uncertainty(inverse @ filling @ inverse, critical, tuple(places))


def _free_shapes(causes: Sequence[Candidate], runs: int) -> list[tuple[int, int, int]]:
    return [
        (number, i, run)
        for number, cause in enumerate(causes)
        for i, parameter in enumerate(cause.effect.shape)
        if parameter.default is None and not parameter.forms
        for run in (range(runs) if parameter.per_run else (-1,))
    ]


def _moved(causes: Sequence[Candidate], number: int, i: int, run: int) -> tuple[list[Candidate], float]:
    cause = causes[number]
    low, high = cause.effect.shape[i].typical
    now = cause.shapes[max(run, 0)][i]
    step = STEP * (abs(now) if low > 0 and high / low > 4 else high - low)
    moved = cause.reshaped(i, now + step, None if run < 0 else [run])
    return [moved if k == number else c for k, c in enumerate(causes)], step
