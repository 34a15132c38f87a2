"""Whether a drive's own velocity says what its angle does."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.check.finding import Finding
from pipelines.settings.rig import Register
from pipelines.settings.rig.register import DIMENSION, UNITS

MOVED_RAD = 0.02
"""Travel from which on the two can be compared."""
TOLERANCE = 0.25
CORRELATED = 0.9
STANDING_RAD = 0.05
"""What the velocity may add up to while the angle stands."""


def check_velocity(
    device: str, where: str, register: Register, t: NDArray, q: NDArray, dq: NDArray
) -> Iterator[Finding]:
    """Compare the integral of the velocity with the angle.

    Parameters
    ----------
    device, where : str
        Name of the drive; its read block in the rig file.
    register : Register
        The velocity's.
    t, q, dq : (n,) arrays
        Instants of the samples (s), angle (rad), velocity (rad/s).
    """
    if len(t) < 3:
        return
    travel = np.r_[0.0, np.cumsum(0.5 * (dq[1:] + dq[:-1]) * np.diff(t))]
    angle, integral = q - q.mean(), travel - travel.mean()
    if np.ptp(q) < MOVED_RAD:
        if np.ptp(travel) > STANDING_RAD + np.ptp(q):
            yield Finding(
                device,
                f"velocity says that the joint went {np.ptp(travel):.3g} rad in {t[-1] - t[0]:.2g}"
                f" s, but its angle changed by {np.ptp(q):.2g} rad; compare {where}.velocity with"
                " the device's manual",
            )
        return
    ratio = float(integral @ angle / (angle @ angle))
    correlation = (
        float(integral @ angle / np.sqrt((integral @ integral) * (angle @ angle)))
        if integral.any()
        else 0.0
    )
    if abs(correlation) < CORRELATED:
        yield Finding(
            device,
            f"velocity does not follow the angle (correlation {correlation:.2f}); compare"
            f" {where}.velocity with the device's manual",
        )
    elif ratio < 0:
        yield Finding(
            device,
            f"velocity is negative where the angle grows ({ratio:.3g} of its rate of change,"
            f" expected 1); turn the sign of {where}.velocity.scale",
        )
    elif abs(ratio - 1.0) > TOLERANCE:
        yield Finding(
            device,
            f"velocity is {ratio:.3g} times the rate of change of the angle, expected 1; "
            f"{_unit(register, ratio, where)}",
        )


def _unit(register: Register, ratio: float, where: str) -> str:
    for unit in DIMENSION["velocity"]:
        if abs(ratio * UNITS[unit] / UNITS[register.unit] - 1.0) <= TOLERANCE:
            return (
                f'with unit = "{unit}" the two agree: correct {where}.velocity, or the angle\'s'
                " unit"
            )
    return f"correct {where}.velocity.scale (or the gear ratio in it), or the angle's unit"
