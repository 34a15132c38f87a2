"""What no rig that a person may be strapped into needs: limits so wide that nothing would be
watched any more."""

from collections.abc import Iterator
from math import pi
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipelines.settings.rig import DriveSettings, RigSettings, SafetySettings

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
MOST_GRAVITY_M_S2 = 30.0
"""More than any planet has; 9.81 in cm/s² is beyond it."""
MOST_LENGTH_M = 5.0
"""More than any limb has, and any machine that moves one; 389.52 mm and 38.952 cm are beyond it."""
STOP_S = 1.0
"""The longest that a stop may take from the highest speed."""


def refuse_absurd(rig: "RigSettings") -> None:
    """Raise ValueError where a limit of a rig would not keep anybody from harm."""
    for complaint in _complaints(rig):
        raise ValueError(f"{complaint}; a rig that moves somebody needs no more")


def _complaints(rig: "RigSettings") -> Iterator[str]:
    for i, drive in enumerate(rig.drive):
        for name, most in DRIVE.items():
            yield from _above(f"drive[{i}].{name}", getattr(drive, name), most)
        for angle in drive.angle_rad:
            if not abs(angle) <= 2 * pi:
                yield (
                    f"drive[{i}].angle_rad: found {angle:g}, expected radians, at most one turn"
                    " either way"
                )
    for name, most in SAFETY.items():
        yield from _above(f"safety.{name}", getattr(rig.safety, name), most)
    for run in ("exo_alone", "with_human"):
        force = rig.in_force(run)
        for drive in force.drive:
            yield from _slow_stop(drive, force.safety, run)


def _above(key: str, found: float, most: float) -> Iterator[str]:
    if not found <= most:
        yield f"{key}: found {found:g}, expected at most {most:g}"


def _slow_stop(drive: "DriveSettings", safety: "SafetySettings", run: str) -> Iterator[str]:
    """Complain of a stop that takes too long, or leads beyond all angles that the joint has."""
    speed, slowing, room = (
        drive.speed_rad_s,
        safety.deceleration_rad_s2,
        drive.angle_rad[1] - drive.angle_rad[0],
    )
    needed = max(speed / STOP_S, speed**2 / 2.0 / room)
    if slowing < needed:
        yield (
            f"safety.deceleration_rad_s2: found {slowing:g}, with which the {drive.joint} takes"
            f" {speed / slowing:.3g} s and {speed**2 / 2.0 / slowing:.3g} rad to stop from its"
            f" {speed:g} rad/s ({run}), expected at least {needed:.3g}: {STOP_S:g} s, and no more"
            " than its angle_rad"
        )
