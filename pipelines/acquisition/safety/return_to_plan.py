"""The way back to the plan after samples were missed: one step of a set-point towards it."""

from math import copysign, sqrt

from pipelines.acquisition.safety.limits import clamped
from pipelines.errors import DeviceError
from pipelines.settings.rig.devices import DriveSettings
from pipelines.settings.rig.safety import SafetySettings

NO_LAG_RAD = 1e-9
"""Rounding error between a set-point and the plan."""

Path = tuple[float, float, float]
"""The plan's set-points due now, a cycle before, and two cycles before, rad."""


def step_to_plan(
    drive: DriveSettings,
    safety: SafetySettings,
    path: Path,
    base: float,
    speed: float,
    took_s: float,
    rate_hz: float,
) -> tuple[float, float]:
    """Return a set-point along the plan, or on the way back to it, and its speed.

    The way back begins as fast as set-points move already, goes faster and slower as gently as a
    stop does, and is no longer than the time allows.

    Parameters
    ----------
    drive, safety
        The limits of the drive and of the rig.
    path : Path
        Set-points of the plan, rad.
    base, speed : float
        Where the set-points are, rad, and how fast they move, rad/s.
    took_s : float
        Time since the last set-point, at most a cycle.
    rate_hz : float
        Cycles a second.

    Returns
    -------
    tuple of float
        Set-point, rad, and its speed, rad/s.

    Raises
    ------
    DeviceError
        The way back is longer than the watchdog's time at the speed limit.
    """
    # Share of the speed limit for the way back to the plan: a drive may overshoot.
    walk = 0.8
    due, before, earlier = path
    along, was, lag = (due - before) * rate_hz, (before - earlier) * rate_hz, before - base
    # Exactly on the plan: its own set-point, without rounding.
    if lag == 0.0 and speed == was:
        return due, along
    deceleration = safety.deceleration_rad_s2
    # Half of what a stop slows down by is left for what samples make of a parabola.
    # So v² = 2 (a / 2) lag, but no further than the lag within one sample.
    softly = min(abs(lag) * rate_hz, sqrt(deceleration * abs(lag)))
    # A drive that is sent from rest to its speed limit within a sample jerks the leg with all of
    # its torque.
    change = max(deceleration, abs(along - was) * rate_hz) * took_s
    fastest = max(abs(along), walk * drive.speed_rad_s)
    next_speed = clamped(along + copysign(softly, lag), speed - change, speed + change)
    next_speed = clamped(next_speed, -fastest, fastest)
    is_on_plan = abs(lag) < NO_LAG_RAD and next_speed == along
    # Not a whole cycle's way: after a late set-point the next comes soon, and both may fall into
    # one sample.
    reference = base + (due - before if is_on_plan else next_speed * took_s)
    _refuse_to_lag(drive, safety, abs(due - reference))
    return (due if abs(reference - due) < NO_LAG_RAD else reference), next_speed


def _refuse_to_lag(drive: DriveSettings, safety: SafetySettings, lag: float) -> None:
    """Refuse to go on where the way back to the plan, rad, is too long."""
    allowed = drive.speed_rad_s * safety.watchdog_s
    if not lag <= allowed:
        raise DeviceError(
            f"{drive.joint}: its set-points are {lag:.3f} rad behind the plan after missed"
            f" samples, allowed are {allowed:.3f} rad (speed_rad_s x watchdog_s); its answers"
            " are lost too often, or this computer is too busy"
        )
