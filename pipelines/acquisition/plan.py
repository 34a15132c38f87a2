"""The plan of a run: all set-points from rest into the motion, through it, and back to rest."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.plan_checks import (
    refuse_fast_between_set_points,
    refuse_path_outside,
    refuse_run_outside,
)
from pipelines.acquisition.set_points import SetPoints
from pipelines.errors import DeviceError, InputError
from pipelines.mechanics.ramp import smooth_share
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.safety import LONGEST_RAMP_S


@dataclass(frozen=True)
class Plan:
    """Set-points, one a sample; each is reached at its sample's end."""

    reference: SetPoints | NDArray
    """(n, J) rad."""
    first: int
    """Index of the first sample that is recorded."""
    stop: int
    """Index after the last one."""


def make_plan(
    rig: RigSettings,
    trajectory: Trajectory,
    start: NDArray,
    duration_s: float,
    sample_rate_hz: float,
) -> Plan:
    """Plan a run, or refuse it.

    The ramp is a smooth share, 0 to 1, of the motion itself, so the leg leaves rest without a jump
    in speed and arrives in the motion at its speed. ``settle_s`` later the recording begins, in
    phase with the trajectory's start. The same share, 1 to 0, leads back to where the leg stood.

    Parameters
    ----------
    rig : RigSettings
        With the limits in force.
    trajectory : Trajectory
        The motion.
    start : (J,) array
        Where the leg stands, rad.
    duration_s : float
        Length of the recording.
    sample_rate_hz : float
        Set-points a second.

    Returns
    -------
    Plan
        Within the rig's limits from its first set-point to its last.

    Raises
    ------
    InputError
        The trajectory, or every ramp of at most ``LONGEST_RAMP_S``, breaks a limit.
    """
    # Checked before with the file alone; here it gives the number of set-points.
    samples = check_trajectory(rig, trajectory, duration_s, sample_rate_hz)
    lead_in = _ramp(rig, trajectory, start, sample_rate_hz, before=True, end_s=duration_s)
    lead_out = _ramp(rig, trajectory, start, sample_rate_hz, before=False, end_s=duration_s)
    reference = SetPoints(lead_in, partial(_run, trajectory, sample_rate_hz), samples, lead_out)
    refuse_path_outside(rig, reference, start, sample_rate_hz)
    return Plan(reference, reference.first, reference.stop)


def check_trajectory(
    rig: RigSettings, trajectory: Trajectory, duration_s: float, sample_rate_hz: float
) -> int:
    """Return how many set-points a run has.

    Raises
    ------
    InputError
        The trajectory is too short, or breaks a limit of the rig.
    """
    if duration_s > trajectory.duration_s + 1e-9:
        raise InputError(
            f"the trajectory lasts {trajectory.duration_s:g} s and does not repeat, but the run's"
            f" duration_s is {duration_s:g}; shorten the run, or give omega_rad_s"
        )
    nowhere = np.empty((0, len(rig.drive)))
    samples = round(duration_s * sample_rate_hz)
    run = SetPoints(nowhere, partial(_run, trajectory, sample_rate_hz), samples, nowhere)
    for first, piece in run.pieces():
        refuse_run_outside(rig, piece, first, sample_rate_hz)
        stop = first + len(piece)
        refuse_fast_between_set_points(rig, trajectory, first, stop, sample_rate_hz)
    return samples


def check_start(rig: RigSettings, angle: NDArray) -> None:
    """Refuse to move the leg from where it stands outside its limits.

    Parameters
    ----------
    rig : RigSettings
        With the limits of J joints.
    angle : (J,) array
        Where the leg stands, rad.

    Raises
    ------
    DeviceError
        Names the joint and its angle.
    """
    for drive, value in zip(rig.drive, angle, strict=True):
        low, high = drive.angle_rad
        if not low <= value <= high:
            raise DeviceError(
                f"the {drive.joint} stands at {value:.3f} rad, outside its limits {low:g} to"
                f" {high:g} rad; move the leg by hand, or check the encoder's zero"
            )


def _run(trajectory: Trajectory, sample_rate_hz: float, begin: int, end: int) -> NDArray:
    """Return set-points (n, J) of the recorded part, from one sample to before another."""
    # A set-point is reached half a sample after its instant, which is the middle of the window.
    return trajectory.at((np.arange(begin, end) + 0.5) / sample_rate_hz)[0]


def _ramp(
    rig: RigSettings,
    trajectory: Trajectory,
    rest: NDArray,
    rate: float,
    *,
    before: bool,
    end_s: float,
) -> NDArray:
    """Return the shortest ramp (n, J) from or to rest that keeps the limits, and settles before."""
    # Factor by which a ramp that breaks a speed limit is lengthened.
    ramp_growth = 1.2
    ramp_s = rig.safety.ramp_s
    settle_s = rig.safety.settle_s if before else 0.0
    limits = np.array([drive.speed_rad_s for drive in rig.drive])
    while ramp_s <= LONGEST_RAMP_S:
        ahead = (np.arange(round((ramp_s + settle_s) * rate)) + 0.5) / rate
        share = smooth_share(ahead / ramp_s)[:, np.newaxis]
        # Time runs backwards from the motion's beginning, and forwards from its end. The share
        # grows towards the motion.
        motion = _extended(trajectory, -ahead[::-1] if before else end_s + ahead)
        reference = rest + (share if before else share[::-1]) * (motion - rest)
        # With where the leg stands, as the first or last step counts as well.
        path = np.vstack([rest, reference] if before else [reference, rest])
        speed = np.abs(np.diff(path, axis=0)).max(axis=0) * rate
        if (speed <= limits).all():
            return reference
        ramp_s *= ramp_growth
    slowest = rig.drive[int(np.argmax(speed / limits))]
    raise InputError(
        f"no ramp of at most {LONGEST_RAMP_S:g} s leads the {slowest.joint} between rest and the"
        f" trajectory below its {slowest.speed_rad_s:g} rad/s; start nearer to the motion"
    )


def _extended(trajectory: Trajectory, time: NDArray) -> NDArray:
    """Return angles (n, J) before or after the motion; one that runs once stands still there."""
    if trajectory.period_s is None:
        time = np.clip(time, 0.0, trajectory.duration_s)
    return trajectory.at(np.mod(time, trajectory.period_s) if trajectory.period_s else time)[0]
