"""Whether the columns of a log agree: velocity integrates to angle, torque does work."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SPAN = 20
"""Samples over which a velocity is integrated: long against the noise of an angle, short against drift."""
MOST = 200_000
"""Rows that are looked at, from the middle of the log."""


@dataclass(frozen=True)
class Agreement:
    """How one column follows from another: slope and the share of the variance that it explains."""

    slope: float
    explained: float


def integral_agreement(time_s: NDArray, angle: NDArray, velocity: NDArray) -> Agreement | None:
    """Compare steps of an angle (n,) with the integral of a velocity (n,) over them, in any units.

    ``slope`` is velocity's integral for a unit of angle: 1 where units and signs agree, -1 where signs differ.
    None where nothing moves.
    """
    time_s, angle, velocity = whole_rows(time_s, angle, velocity)
    if len(time_s) < 5 * SPAN:
        return None
    travel = np.concatenate([[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time_s))])
    return _through_origin(angle[SPAN:] - angle[:-SPAN], travel[SPAN:] - travel[:-SPAN])


def _through_origin(x: NDArray, y: NDArray) -> Agreement | None:
    """Return y = slope x; the mean of both regressions' slopes, for both columns have noise."""
    xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
    if xx == 0.0 or yy == 0.0 or xy == 0.0:
        return None
    return Agreement(float(np.sign(xy)) * np.sqrt(yy / xx), xy**2 / (xx * yy))


def mean_power(time_s: NDArray, angle: NDArray, torque: NDArray) -> tuple[float, float]:
    """Return mean and mean magnitude, W, of torque (n,) N·m times the derivative of the angle (n,) rad at times (n,) s.

    What a drive delivers between two instants of equal state can only have gone into friction: the mean is positive
    where the signs of both columns agree.
    """
    time_s, angle, torque = whole_rows(time_s, angle, torque)
    if len(time_s) < 5 * SPAN:
        return 0.0, 0.0
    velocity = (angle[SPAN:] - angle[:-SPAN]) / (time_s[SPAN:] - time_s[:-SPAN])
    averaged = np.convolve(torque, np.ones(SPAN + 1) / (SPAN + 1), "valid")
    power = averaged * velocity
    return float(np.mean(power)), float(np.mean(np.abs(power)))


def whole_rows(*columns: NDArray) -> list[NDArray]:
    """Return the rows of columns (n,), from the middle of the log, in which every column has a number."""
    middle = slice(max(0, (len(columns[0]) - MOST) // 2), (len(columns[0]) + MOST) // 2)
    known = np.all([np.isfinite(column[middle]) for column in columns], axis=0)
    return [column[middle][known] for column in columns]
