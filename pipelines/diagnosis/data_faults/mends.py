"""Mended motions: the same run with another clock or other angles."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import joints_of
from pipelines.contracts.table import Table
from pipelines.errors import InputError
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import Motion, motion_from_table
from pipelines.settings.filter import FilterSettings


def mended(
    motion: Motion, time: NDArray | None = None, angle: NDArray | None = None
) -> Motion | None:
    """Return a run filtered again, with other stamps or angles.

    Parameters
    ----------
    motion : Motion
        n samples.
    time : (n,) array, optional
        s; rows that do not come after all before them are left out.
    angle : (n, J) array, optional
        Measured angles, rad.

    Returns
    -------
    Motion or None
        None where the run has no measured angles, or cannot be filtered with these.
    """
    angle = motion.measured_angle if angle is None else angle
    if angle is None:
        return None
    time = motion.time if time is None else time
    later = np.diff(np.maximum.accumulate(time), prepend=-np.inf) > 0.0
    frame = {"time_s": time[later]}
    for j, joint in enumerate(joints_of(motion.metadata)):
        frame[joint.column("angle")] = angle[later, j]
        frame[joint.column("torque")] = motion.torque[later, j]
    table = Table(pd.DataFrame(frame), motion.metadata, Path(motion.file))
    try:
        result = motion_from_table(
            motion_table(table, FilterSettings(cutoff_hz=motion.cutoff_hz)), motion.geometry
        )
    except InputError:
        return None
    return replace(
        result,
        valid=result.valid & motion.valid[later],
        geometry=motion.geometry,
        scales=motion.scales,
        file=motion.file,
    )
