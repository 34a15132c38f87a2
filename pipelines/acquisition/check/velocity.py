"""Whether a drive's own velocity agrees with its angle."""

from collections.abc import Iterator

import numpy as np

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.settings.rig import Register
from pipelines.settings.rig.register import DIMENSION, UNITS

TOLERANCE = 0.25
"""Largest relative deviation of a ratio from that of two units or scales."""
MOVED_RAD = 0.02
"""Least travel for a comparison, rad."""


def shows_velocity(series: Series) -> bool:
    """Return whether a device moved enough for its velocity to be compared with its angle."""
    names = set(series.block.names)
    return {"angle", "velocity"} <= names and bool(np.ptp(series.of("angle")) >= MOVED_RAD)


def check_velocity(probe: Probe, series: Series, rate_hz: float | None) -> Iterator[Finding]:
    """Compare the integral of a drive's velocity, if it has one, with its angle.

    Parameters
    ----------
    series : Series
        Answers of the drive.
    rate_hz : float, optional
        Samples a second in lockstep; else the instants of the answers are used.
    """
    # Least correlation of angle and integral; below it, the register holds another quantity.
    correlated = 0.9
    # Largest integral of the velocity while the angle is constant.
    standing_rad = 0.05
    register = series.block.registers.get("velocity")
    if register is None:
        return
    where, fresh = f"{probe.map_path}.read", series.fresh
    t = series.answered[fresh]
    if probe.in_lockstep and rate_hz:
        t = np.arange(len(fresh)) / rate_hz
    q, dq = series.of("angle")[fresh], series.of("velocity")[fresh]
    if len(t) < 3:
        return
    travel = np.r_[0.0, np.cumsum(0.5 * (dq[1:] + dq[:-1]) * np.diff(t))]
    # Without means, as an integral has no zero of its own.
    angle, integral = q - q.mean(), travel - travel.mean()
    if np.ptp(q) < MOVED_RAD:
        if np.ptp(travel) > standing_rad + np.ptp(q):
            yield probe.finding(
                f"velocity integrates to {np.ptp(travel):.3g} rad, but the angle changed by"
                f" {np.ptp(q):.2g} rad; compare {where}.velocity with the manual",
            )
        return
    ratio = float(integral @ angle / (angle @ angle))
    correlation = 0.0
    if integral.any():
        correlation = float(integral @ angle / np.sqrt((integral @ integral) * (angle @ angle)))
    if abs(correlation) < correlated:
        yield probe.finding(
            f"velocity does not follow the angle (correlation {correlation:.2f}); compare"
            f" {where}.velocity with the device's manual",
        )
    elif abs(ratio - 1.0) > TOLERANCE:
        yield probe.finding(
            f"velocity is {ratio:.3g} times the rate of change of the angle, expected 1; "
            f"{_remedy(register, ratio, where)}",
        )


def _remedy(register: Register, ratio: float, where: str) -> str:
    if ratio < 0.0:
        return f"change the sign of {where}.velocity.scale"
    for unit in DIMENSION["velocity"]:
        if abs(ratio * UNITS[unit] / UNITS[register.unit] - 1.0) <= TOLERANCE:
            return f'with unit = "{unit}" the two agree: correct {where}.velocity'
    decade = 10.0 ** round(np.log10(ratio))
    if decade != 1.0 and abs(ratio / decade - 1.0) <= TOLERANCE:
        factor = max(decade, 1.0 / decade)
        return f"correct the scale of {where}.angle or {where}.velocity, by a factor of {factor:g}"
    return f"correct {where}.velocity.scale (or the gear ratio in it), or the angle's unit"
