"""Filter a recording and say what was found on the way."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.table import Table
from pipelines.mechanics.kinematics import motion_table
from pipelines.settings.filter import FilterSettings


@dataclass(frozen=True)
class Filtered:
    """A ``motion/1`` table and how its recording fared."""

    motion: Table
    cutoff_hz: float
    why: str
    segments: int
    valid_share: float
    noise: NDArray
    """(J,) rms of measured less filtered angle, rad: the encoder's noise and what the filter took."""
    velocity_difference: NDArray | None
    """(J,) rms of the drive's own velocity less the filtered one, rad/s; None where the drive gave none."""


def filter_recording(recording: Table, settings: FilterSettings) -> Filtered:
    """Make a motion of a ``recording/1`` table."""
    motion = motion_table(recording, settings)
    frame = motion.frame
    valid = frame["valid"].to_numpy(bool)
    joints = motion.joints
    drive = [joint.column("velocity_measured") for joint in joints]
    return Filtered(
        motion=motion,
        cutoff_hz=motion.metadata["filter"]["cutoff_hz"],
        why=motion.metadata["filter"]["why"],
        segments=int(frame["segment"].nunique()),
        valid_share=float(valid.mean()),
        noise=_rms((motion.stacked("angle_measured") - motion.stacked("angle"))[valid]),
        velocity_difference=(
            _rms((frame[drive].to_numpy(float) - motion.stacked("velocity"))[valid])
            if set(drive) <= set(frame.columns)
            else None
        ),
    )


def _rms(x: NDArray) -> NDArray:
    return np.sqrt(np.nanmean(x**2, axis=0))
