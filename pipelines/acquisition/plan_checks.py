"""Refuses plans that leave a rig's limits, before anything moves."""

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.set_points import SetPoints
from pipelines.errors import InputError
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.rig import RigSettings

TOO_FAST = 1.05
"""Times the speed limit that a motion may reach between two set-points that keep it."""


def refuse_run_outside(rig: RigSettings, run: NDArray, first: int, rate: float) -> None:
    """Refuse a piece of a run that leaves the drives' limits.

    Parameters
    ----------
    rig : RigSettings
        With the limits in force.
    run : (n, J) array
        Set-points, rad.
    first : int
        Index of the first of them in the run.
    rate : float
        Set-points a second.
    """
    margin = rig.safety.angle_margin_rad
    speed = np.diff(run, axis=0) * rate
    for j, drive in enumerate(rig.drive):
        low, high = drive.angle_rad[0] + margin, drive.angle_rad[1] - margin
        k = _first_outside(run[:, j], low, high)
        if k is not None:
            raise InputError(
                f"the {drive.joint} would be at {run[k, j]:.3f} rad at"
                f" {(first + k + 0.5) / rate:.3f} s, but the rig allows {low:g} to {high:g} rad"
                " (its limits less angle_margin_rad); make the excitation smaller, or design it"
                " within the rig's limits"
            )
        k = _first_outside(speed[:, j], -drive.speed_rad_s, drive.speed_rad_s)
        if k is not None:
            raise InputError(
                f"the {drive.joint} would move at {speed[k, j]:.3f} rad/s at"
                f" {(first + k + 0.5) / rate:.3f} s, but the rig allows {drive.speed_rad_s:g}"
                " rad/s; make the excitation slower or smaller"
            )


def refuse_fast_between_set_points(
    rig: RigSettings, trajectory: Trajectory, begin: int, end: int, rate: float
) -> None:
    """Refuse a motion that turns round from one set-point to the next.

    Its set-points show a slow motion, and would be within the limits.

    Parameters
    ----------
    rig : RigSettings
        With the limits in force.
    trajectory : Trajectory
        The motion.
    begin, end : int
        Set-points of the run between which it is checked.
    rate : float
        Set-points a second.
    """
    for share in (0.5, 0.75):  # where the one shows a standstill, the other does not
        speed = trajectory.at((np.arange(begin, end) + share) / rate)[1]
        for j, drive in enumerate(rig.drive):
            fastest = TOO_FAST * drive.speed_rad_s
            k = _first_outside(speed[:, j], -fastest, fastest)
            if k is not None:
                raise InputError(
                    f"the {drive.joint} would move at {speed[k, j]:.3f} rad/s at"
                    f" {(begin + k + share) / rate:.3f} s, which {rate:g} set-points a second do"
                    f" not show, but the rig allows {drive.speed_rad_s:g} rad/s; make the"
                    " excitation slower: is its omega_rad_s in rad/s?"
                )


def refuse_path_outside(rig: RigSettings, reference: SetPoints, rest: NDArray, rate: float) -> None:
    """Refuse a plan that leaves the drives' limits on the way into the run or out of it.

    A run shorter than the trajectory's period does not show where the ramps lead: they run its
    other phases.

    Parameters
    ----------
    rig : RigSettings
        With the limits in force.
    reference : SetPoints
        The plan, (n, J) rad.
    rest : (J,) array
        Where the leg stands before and after it, rad.
    rate : float
        Set-points a second.
    """
    for first, piece in reference.pieces():
        begins, ends = first == 0, first + len(piece) == len(reference)
        path = np.vstack([*([rest] if begins else []), piece, *([rest] if ends else [])])
        # Index 0 of the path is where the leg stands.
        _refuse_piece_outside(rig, reference, path, first + (0 if begins else 1), rate)


def _refuse_piece_outside(
    rig: RigSettings, reference: SetPoints, path: NDArray, first: int, rate: float
) -> None:
    """Refuse a piece (n, J) of the path, whose first set-point has the index ``first`` in it."""
    speed = np.diff(path, axis=0) * rate
    for j, drive in enumerate(rig.drive):
        low, high = drive.angle_rad
        k = _first_outside(path[:, j], low, high)
        if k is not None:
            way = "into" if first + k <= reference.first else "out of"
            raise InputError(
                f"the {drive.joint} would be at {path[k, j]:.3f} rad on the way {way} the run, but"
                f" the rig allows {low:g} to {high:g} rad; make the excitation smaller, or record a"
                " whole period of it to see where it leaves the limits"
            )
        fastest = drive.speed_rad_s * (1.0 + 1e-9)
        k = _first_outside(speed[:, j], -fastest, fastest)
        if k is not None:
            raise InputError(
                f"the {drive.joint} would move at {speed[k, j]:.3f} rad/s"
                f" {(first + k - reference.first) / rate:.3f} s after the run's beginning, but the"
                f" rig allows {drive.speed_rad_s:g} rad/s; make the excitation slower"
            )


def _first_outside(values: NDArray, low: float, high: float) -> int | None:
    """Return where values (n,) first leave a range, or are no numbers; None where all keep it."""
    outside = ~((values >= low) & (values <= high))
    return int(np.argmax(outside)) if outside.any() else None
