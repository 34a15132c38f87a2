"""A ``recording/1`` of the plant without devices, for tests and identification campaigns."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.mechanics.motion import CUFFS
from pipelines.mechanics.ramp import smooth_share
from pipelines.mechanics.trajectory import Trajectory
from pipelines.rig.plant import JOINTS, Plant

LEAD_S = 4.0
"""Time for the way from rest into the motion, in which transients decay."""


def record(
    plant: Plant, trajectory: Trajectory, duration_s: float, purpose: str = "train"
) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Simulate a run along a trajectory.

    Physics and channels are those of the rig behind Modbus. The leg goes from rest into the motion
    first; the recording begins where the motion repeats.

    Parameters
    ----------
    plant : Plant
        The virtual machine.
    trajectory : Trajectory
        Of hip and knee.
    duration_s : float
        s.
    purpose : str, optional
        ``train`` or ``validate``.

    Returns
    -------
    tuple
        Table and metadata of ``recording/1``.
    """
    rate = plant.sample_rate_hz
    # The lead-in moves the plant on; its samples are not part of the recording.
    lead, count = round(LEAD_S * rate), round(duration_s * rate)
    enabled = np.ones(len(JOINTS), dtype=np.bool_)
    plant.run(_lead_in(plant.reference, trajectory, lead, rate), enabled)
    # A set-point is reached half a sample after the instant it belongs to.
    measured = plant.run(trajectory.at((np.arange(count) + 0.5) / rate)[0], enabled)
    columns: dict[str, NDArray] = {"time_s": measured.time - measured.time[0]}
    for j, joint in enumerate(JOINTS):
        columns[f"{joint}_angle_rad"] = measured.angle[:, j]
        columns[f"{joint}_torque_nm"] = measured.torque[:, j]
        columns[f"{joint}_reference_rad"] = measured.reference[:, j]
        columns[f"{joint}_velocity_rad_s"] = measured.velocity[:, j]
        columns[f"{joint}_temperature_c"] = measured.temperature[:, j]
    if plant.has_human:
        for c, cuff in enumerate(CUFFS):
            columns |= {
                f"{cuff}_force_{axis}_n": measured.forces[:, c, i] for i, axis in enumerate("xyz")
            }
    columns["sequence"] = measured.sequence
    return pd.DataFrame(columns), _metadata(plant, trajectory, purpose)


def _lead_in(start: NDArray, trajectory: Trajectory, samples: int, rate: float) -> NDArray:
    """Return set-points (n, J) rad from rest into the motion, by a share from 0 to 1 of it."""
    ahead = (np.arange(-samples, 0) + 0.5) / rate
    # Three quarters of the lead are the ramp. In the last second the leg follows the motion in
    # full.
    share = smooth_share((ahead + LEAD_S) / (0.75 * LEAD_S))[:, np.newaxis]
    period = trajectory.period_s
    # A motion that does not repeat has no angles before its beginning: its first stands for
    # them.
    motion = trajectory.at(np.mod(ahead, period) if period else np.zeros(samples))[0]
    return start + share * (motion - start)


def _metadata(plant: Plant, trajectory: Trajectory, purpose: str) -> dict[str, Any]:
    lengths = {name: value for name, value in vars(plant.geometry).items() if value is not None}
    metadata: dict[str, Any] = {
        "run": "with_human" if plant.has_human else "exo_alone",
        "purpose": purpose,
        "sample_rate_hz": plant.sample_rate_hz,
        "controller": plant.settings.controllers(),
        "geometry": lengths,
    }
    if trajectory.period_s:
        metadata["period_s"] = trajectory.period_s
    return metadata
