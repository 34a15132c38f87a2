"""All set-points of a run, made and checked before anything moves: from rest into the motion, the
run, back to rest."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.set_points import SetPoints
from pipelines.errors import InputError
from pipelines.mechanics.ramp import smooth_share
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.safety import LONGEST_RAMP_S

RAMP_GROWTH = 1.2
TOO_FAST = 1.05
"""Times the speed limit that a motion may reach between two set-points that keep it."""


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
    start : (J,) array
        Where the leg stands, rad.
    duration_s : float
        Length of the recording.
    """
    samples = check_trajectory(rig, trajectory, duration_s, sample_rate_hz)
    lead_in = _ramp(rig, trajectory, start, sample_rate_hz, before=True, end_s=duration_s)
    lead_out = _ramp(rig, trajectory, start, sample_rate_hz, before=False, end_s=duration_s)
    reference = SetPoints(lead_in, partial(_run, trajectory, sample_rate_hz), samples, lead_out)
    _refuse_ramps_outside(rig, reference, start, sample_rate_hz)
    return Plan(reference, reference.first, reference.stop)


def check_trajectory(
    rig: RigSettings, trajectory: Trajectory, duration_s: float, sample_rate_hz: float
) -> int:
    """Return how many set-points a run has, or refuse a trajectory that is too short or leaves the
    rig's limits."""
    if duration_s > trajectory.duration_s + 1e-9:
        raise InputError(
            f"the trajectory lasts {trajectory.duration_s:g} s and does not repeat, but the run's"
            f" duration_s is {duration_s:g}; shorten the run, or give the trajectory's omega_rad_s"
            " if it repeats"
        )
    nowhere = np.empty((0, len(rig.drive)))
    samples = round(duration_s * sample_rate_hz)
    run = SetPoints(nowhere, partial(_run, trajectory, sample_rate_hz), samples, nowhere)
    for first, piece in run.pieces():
        _refuse_outside(rig, piece, first, sample_rate_hz)
        _refuse_what_set_points_do_not_show(
            rig, trajectory, first, first + len(piece), sample_rate_hz
        )
    return samples


def _refuse_what_set_points_do_not_show(
    rig: RigSettings, trajectory: Trajectory, begin: int, end: int, rate: float
) -> None:
    """Refuse a motion too fast for so few set-points: from one to the next it turns round, and they
    show a slow one."""
    for share in (0.5, 0.75):  # where the one shows a standstill, the other does not
        speed = trajectory.at((np.arange(begin, end) + share) / rate)[1]
        for j, drive in enumerate(rig.drive):
            fastest = TOO_FAST * drive.speed_rad_s
            if (k := _first_outside(speed[:, j], -fastest, fastest)) is not None:
                raise InputError(
                    f"the {drive.joint} would move at {speed[k, j]:.3f} rad/s at"
                    f" {(begin + k + share) / rate:.3f} s, which {rate:g} set-points a second do"
                    f" not show, but the rig allows {drive.speed_rad_s:g} rad/s; make the"
                    " excitation slower: is its omega_rad_s in rad/s?"
                )


def _run(trajectory: Trajectory, sample_rate_hz: float, begin: int, end: int) -> NDArray:
    """Return set-points (n, J) of the recorded part, from one sample to before another."""
    # A set-point is reached half a sample after the instant it belongs to, the middle of the
    # window.
    return trajectory.at((np.arange(begin, end) + 0.5) / sample_rate_hz)[0]


def check_start(rig: RigSettings, angle: NDArray) -> str | None:
    """Return why the leg must not be moved from where it stands, (J,) rad; None if it may."""
    for drive, value in zip(rig.drive, angle, strict=True):
        low, high = drive.angle_rad
        if not low <= value <= high:
            return (
                f"the {drive.joint} stands at {value:.3f} rad, outside its limits {low:g} to"
                f" {high:g} rad; move the leg by hand, or check the encoder's zero"
            )
    return None


def _ramp(
    rig: RigSettings,
    trajectory: Trajectory,
    rest: NDArray,
    rate: float,
    *,
    before: bool,
    end_s: float,
) -> NDArray:
    """Return the shortest ramp from or to rest that keeps the limits, with the settling time (n,
    J)."""
    ramp_s = rig.safety.ramp_s
    settle_s = rig.safety.settle_s if before else 0.0
    while ramp_s <= LONGEST_RAMP_S:
        ahead = (np.arange(round((ramp_s + settle_s) * rate)) + 0.5) / rate
        share = smooth_share(ahead / ramp_s)[:, np.newaxis]
        # Time runs backwards from the motion's beginning, forwards from its end; the share grows
        # towards it.
        motion = _extended(trajectory, -ahead[::-1] if before else end_s + ahead)
        reference = rest + (share if before else share[::-1]) * (motion - rest)
        path = np.vstack([rest, reference] if before else [reference, rest])
        speed = np.abs(np.diff(path, axis=0)).max(axis=0) * rate
        if all(
            fastest <= drive.speed_rad_s for fastest, drive in zip(speed, rig.drive, strict=True)
        ):
            return reference
        ramp_s *= RAMP_GROWTH
    slowest = rig.drive[int(np.argmax(speed / [drive.speed_rad_s for drive in rig.drive]))]
    raise InputError(
        f"no ramp of at most {LONGEST_RAMP_S:g} s leads the {slowest.joint} between rest and the"
        f" trajectory below its {slowest.speed_rad_s:g} rad/s; start with the leg nearer to the"
        " motion"
    )


def _extended(trajectory: Trajectory, time: NDArray) -> NDArray:
    """Return angles (n, J) at times before or after the motion; one that runs once stands still
    there."""
    if trajectory.period_s is None:
        time = np.clip(time, 0.0, trajectory.duration_s)
    return trajectory.at(np.mod(time, trajectory.period_s) if trajectory.period_s else time)[0]


def _first_outside(values: NDArray, low: float, high: float) -> int | None:
    """Return where values (n,) first leave a range or are no numbers; None where all of them keep
    it."""
    outside = ~((values >= low) & (values <= high))
    return int(np.argmax(outside)) if outside.any() else None


def _refuse_ramps_outside(
    rig: RigSettings, reference: SetPoints, rest: NDArray, rate: float
) -> None:
    """Refuse a plan whose ways into and out of the run, or the seams between, leave the drives'
    limits.

    A run shorter than the trajectory's period does not show where the ramps lead: they run its
    other phases.
    """
    for first, piece in reference.pieces():
        begins, ends = first == 0, first + len(piece) == len(reference)
        path = np.vstack([*([rest] if begins else []), piece, *([rest] if ends else [])])
        # Index 0 of the path is where the leg stands.
        _refuse_piece_outside(rig, reference, path, first + (0 if begins else 1), rate)


def _refuse_piece_outside(
    rig: RigSettings, reference: SetPoints, path: NDArray, first: int, rate: float
) -> None:
    """Refuse a piece (n, J) of the path that begins and ends where the leg stands; its number in
    that is ``first``."""
    speed = np.diff(path, axis=0) * rate
    for j, drive in enumerate(rig.drive):
        low, high = drive.angle_rad
        if (k := _first_outside(path[:, j], low, high)) is not None:
            raise InputError(
                f"the {drive.joint} would be at {path[k, j]:.3f} rad on the way"
                f" {'into' if first + k <= reference.first else 'out of'} the run, but the rig"
                f" allows {low:g} to {high:g} rad; make the excitation smaller, or record a whole"
                " period of it to see where it leaves the limits"
            )
        fastest = drive.speed_rad_s * (1.0 + 1e-9)
        if (k := _first_outside(speed[:, j], -fastest, fastest)) is not None:
            raise InputError(
                f"the {drive.joint} would move at {speed[k, j]:.3f} rad/s"
                f" {(first + k - reference.first) / rate:.3f} s after the run's beginning, but the"
                f" rig allows {drive.speed_rad_s:g} rad/s; make the excitation slower"
            )


def _refuse_outside(rig: RigSettings, run: NDArray, first: int, rate: float) -> None:
    """Refuse a piece (n, J) of a run, from sample ``first`` on, that leaves the drives' limits."""
    margin = rig.safety.angle_margin_rad
    speed = np.diff(run, axis=0) * rate
    for j, drive in enumerate(rig.drive):
        low, high = drive.angle_rad[0] + margin, drive.angle_rad[1] - margin
        if (k := _first_outside(run[:, j], low, high)) is not None:
            raise InputError(
                f"the {drive.joint} would be at {run[k, j]:.3f} rad at"
                f" {(first + k + 0.5) / rate:.3f} s, but the rig allows {low:g} to {high:g} rad"
                " (its limits less angle_margin_rad); make the excitation smaller, or design it"
                " within the rig's limits"
            )
        if (k := _first_outside(speed[:, j], -drive.speed_rad_s, drive.speed_rad_s)) is not None:
            raise InputError(
                f"the {drive.joint} would move at {speed[k, j]:.3f} rad/s at"
                f" {(first + k + 0.5) / rate:.3f} s, but the rig allows {drive.speed_rad_s:g}"
                " rad/s; make the excitation slower or smaller"
            )
