"""Bounds of the limits themselves: on a rig for a wearer, wider limits protect nobody."""

from collections.abc import Sequence
from math import pi

from pipelines.settings.rig.devices import DriveSettings
from pipelines.settings.rig.safety import SafetySettings

DRIVE = {"speed_rad_s": 20.0, "torque_nm": 500.0}
SAFETY = {
    "cuff_force_n": 2000.0,
    "following_error_rad": 0.5,
    "watchdog_s": 1.0,
    "connect_s": 60.0,
    "control_s": 30.0,
    "settle_s": 600.0,
}
"""The most that each may be."""


def check_safety_bounds(drives: Sequence[DriveSettings], safety: SafetySettings) -> None:
    """Refuse limits that are too wide to protect a wearer.

    Raises
    ------
    ValueError
        Naming the first such limit, its value and its bound.
    """
    for i, drive in enumerate(drives):
        for name, most in DRIVE.items():
            _check_at_most(f"drive[{i}].{name}", getattr(drive, name), most)
        for angle in drive.angle_rad:
            # Beyond a turn the limits are most likely degrees.
            if not abs(angle) <= 2 * pi:
                raise ValueError(
                    f"drive[{i}].angle_rad: found {angle:g}, expected radians, at most one turn"
                )
    for name, most in SAFETY.items():
        _check_at_most(f"safety.{name}", getattr(safety, name), most)
    # Each kind of run has its own speeds, but both stop with the same deceleration.
    for run in ("exo_alone", "with_human"):
        for drive in drives:
            _check_stop(drive.in_force(run), safety.in_force(run), run)


def _check_at_most(key: str, value: float, most: float) -> None:
    if not value <= most:
        raise ValueError(
            f"{key}: found {value:g}, expected at most {most:g}; no rig for a wearer needs more"
        )


def _check_stop(drive: DriveSettings, safety: SafetySettings, run: str) -> None:
    """Refuse a stop that takes too long, or farther than the joint's range."""
    # The longest that a stop may take from the highest speed.
    stop_s = 1.0
    speed, slowing = drive.speed_rad_s, safety.deceleration_rad_s2
    room = drive.angle_rad[1] - drive.angle_rad[0]
    # A stop from speed v at deceleration a takes v / a, over a distance of v² / (2 a).
    needed = max(speed / stop_s, speed**2 / 2.0 / room)
    if slowing < needed:
        raise ValueError(
            f"safety.deceleration_rad_s2: found {slowing:g}, expected at least {needed:.3g}. To"
            f" stop from {speed:g} rad/s ({run}) the {drive.joint} takes {speed / slowing:.3g} s"
            f" and {speed**2 / 2.0 / slowing:.3g} rad, more than {stop_s:g} s or its angle_rad"
        )
