"""100 |e| / |tau|, as the people who published these data count it, and the error in N·m."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import decimate

from pipelines.estimation.regression import away_from_reversals
from pipelines.mechanics.motion import Motion
from pipelines.model import Model
from pipelines.signals.low_pass import ORDER, low_pass

EDGE = 20
"""Decimated samples at each end of a run where the filter lacks one side."""
SLOW_HZ = 5.0


def decimated(x: NDArray, times: int = 10) -> NDArray:
    """Put (n, ...) behind the authors' parallel filter: low-pass without delay, then every tenth
    sample.

    ``scipy.signal.decimate`` is MATLAB's ``decimate``: Chebyshev I of order 8 at 0.8 of the new
    Nyquist frequency.
    """
    return np.asarray(decimate(x, times, axis=0)[EDGE:-EDGE])


@dataclass(frozen=True)
class TorqueError:
    """Of each joint, (J,)."""

    rms: NDArray
    """N·m, N at a prismatic joint."""
    percent: NDArray
    """100 |e| / |tau|."""


def torque_error(residual: NDArray, torque: NDArray) -> TorqueError:
    """Return the error of a residual (n, J) relative to its torque (n, J)."""
    size, all_of_it = np.linalg.norm(residual, axis=0), np.linalg.norm(torque, axis=0)
    return TorqueError(size / np.sqrt(len(residual)), 100.0 * size / all_of_it)


def _slow(x: NDArray, motion: Motion, order: int) -> NDArray:
    """Put (n, ...) behind a zero-phase low-pass of 5 Hz, on a uniform grid over the samples that
    are valid."""
    inside = np.flatnonzero(motion.valid)
    grid = np.arange(motion.time[0], motion.time[-1], 1.0 / motion.sample_rate_hz)
    kept = (grid >= motion.time[inside[0]]) & (grid <= motion.time[inside[-1]])
    uniform = np.column_stack(
        [np.interp(grid, motion.time, column) for column in x.reshape(len(x), -1).T]
    )
    return low_pass(uniform, motion.sample_rate_hz, SLOW_HZ, order)[kept].reshape(-1, *x.shape[1:])


def slow_error(predicted: NDArray, motion: Motion, order: int = ORDER) -> TorqueError:
    """Return the error below 5 Hz, reversals included, of a predicted torque (n, J)."""
    return torque_error(
        _slow(motion.torque - predicted, motion, order), _slow(motion.torque, motion, order)
    )


def slow_fit(model: Model, motions: Sequence[Motion], order: int = ORDER) -> Model:
    """Return the model by ordinary least squares below 5 Hz, as the README of the data fits it."""
    return model.with_linear(
        slow_values([model] * len(motions), motions, [True] * len(model.linear_parameters), order)
    )


def slow_values(
    models: Sequence[Model], motions: Sequence[Motion], free: Sequence[bool], order: int = ORDER
) -> NDArray:
    """Return the linear values (p,) of models, one for each motion, by ordinary least squares below
    5 Hz.

    Those that are not ``free`` stay what they are in each run.
    """
    chosen = np.asarray(free)
    parts, rights = [], []
    for model, motion in zip(models, motions, strict=True):
        columns, values = model.regressor(motion), model.linear_values
        parts.append(_slow(columns[:, :, chosen], motion, order))
        rights.append(
            _slow(motion.torque - columns[:, :, ~chosen] @ values[~chosen], motion, order)
        )
    A, b = np.concatenate(parts), np.concatenate(rights)
    values = models[0].linear_values.copy()
    values[chosen] = np.linalg.lstsq(A.reshape(-1, A.shape[-1]), b.ravel(), rcond=None)[0]
    return values


def fitted(model: Model, motion: Motion) -> Model:
    """Return the model by ordinary least squares behind the authors' parallel filter."""
    A, b = decimated(model.regressor(motion)), decimated(motion.torque)
    values = np.linalg.lstsq(A.reshape(-1, A.shape[-1]), b.ravel(), rcond=None)[0]
    return model.with_linear(values)


def error_by_place(model: Model, motion: Motion) -> tuple[float, float]:
    """Return the first joint's error, rms in N·m or N, behind that filter: near its reversals, and
    away from them.

    Near is what no fit of ``exoid diagnose`` takes.
    """
    residual = decimated(motion.torque - model.torque(motion))[:, 0]
    away = away_from_reversals(motion)[::10][EDGE:-EDGE, 0]
    return float(np.sqrt(np.mean(residual[~away] ** 2))), float(
        np.sqrt(np.mean(residual[away] ** 2))
    )


def decimated_error(model: Model, motion: Motion) -> TorqueError:
    """Return a model's error on a run behind the authors' parallel filter."""
    return torque_error(decimated(motion.torque - model.torque(motion)), decimated(motion.torque))
