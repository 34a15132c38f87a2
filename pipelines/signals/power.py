"""The mean power of a drive, which shows whether its angle and torque have the same sign."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

STEP = 20
"""Samples over which a velocity is taken: long against noise, short against a motion."""
GIVES_BACK = 0.2
"""Share of the mean magnitude of power that drives may absorb on average."""


def absorbed_w(drives: Iterable[Sequence[NDArray]]) -> float | None:
    """Return the mean power that drives take up together, W; None where they deliver some.

    A single one may take up power, because one joint's motion can drive another one's motor.

    Parameters
    ----------
    drives : iterable of sequences of three (n,) arrays
        Time, angle and torque of each, as of ``mean_power``.
    """
    means, sizes = zip(*(mean_power(*drive) for drive in drives), strict=True)
    return -sum(means) if sum(means) < -GIVES_BACK * sum(sizes) else None


def mean_power(time_s: NDArray, angle: NDArray, torque: NDArray) -> tuple[float, float]:
    """Return the mean and the mean magnitude of a drive's power, W; zeros for a short recording.

    The energy that a drive delivers between two equal states is lost to friction. The mean is thus
    positive where the signs of angle and torque agree.

    Parameters
    ----------
    time_s : (n,) array
        Times, s.
    angle : (n,) array
        Angle, rad, or position, m.
    torque : (n,) array
        Torque, N·m, or force, N.
    """
    if len(time_s) < 5 * STEP:
        return 0.0, 0.0
    velocity = (angle[STEP:] - angle[:-STEP]) / (time_s[STEP:] - time_s[:-STEP])
    # The mean torque over the span of the velocity: a shift in time between both would change their
    # product.
    averaged = np.convolve(torque, np.ones(STEP + 1) / (STEP + 1), "valid")
    power = averaged * velocity
    return float(np.mean(power)), float(np.mean(np.abs(power)))
