"""One sample of a drive, and the meaning of its status word."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class DriveStatus:
    """The meaning of a drive's status word."""

    enabled: bool | None = None
    """Whether the drive follows its set-point; None where it does not report that."""
    fault: str | None = None
    """The fault that it reports, in words; None for none."""


@dataclass(frozen=True)
class Reading(DriveStatus):
    """One sample of a drive in SI units; NaN for quantities that the drive does not report."""

    sequence: int
    time: float
    angle: float
    torque: float
    current: float
    velocity: float
    temperature: float
    reference: float
