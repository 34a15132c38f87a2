"""Refuses plans that leave a rig's limits, before anything moves."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.set_points import SetPoints
from pipelines.errors import InputError
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.rig import RigSettings


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

    def when(k: int) -> str:
        return f"at {(first + k + 0.5) / rate:.3f} s"

    # For the run alone: ramps lead from where the leg stands, which may be nearer to a limit.
    margin = rig.safety.angle_margin_rad
    limits = [(drive.angle_rad[0] + margin, drive.angle_rad[1] - margin) for drive in rig.drive]
    remedy = " (its limits less angle_margin_rad); make the excitation smaller"
    _refuse_beyond(rig, run, limits, "be at", "rad", when, remedy)
    _refuse_fast(rig, np.diff(run, axis=0) * rate, 1.0, when)


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
    # Times the speed limit that a motion may reach between two set-points that keep it.
    too_fast = 1.05
    for share in (0.5, 0.75):  # where the one shows a standstill, the other does not
        instants = (np.arange(begin, end) + share) / rate

        def when(k: int, instants: NDArray = instants) -> str:
            return f"at {instants[k]:.3f} s, which {rate:g} set-points a second do not show"

        _refuse_fast(rig, trajectory.at(instants)[1], too_fast, when)


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
    limits = [drive.angle_rad for drive in rig.drive]
    for first, piece in reference.pieces():
        begins, ends = first == 0, first + len(piece) == len(reference)
        path = np.vstack([*([rest] if begins else []), piece, *([rest] if ends else [])])
        # Index 0 of the whole path is where the leg stands.
        start = 0 if begins else first + 1

        def when(k: int, start: int = start) -> str:
            return f"on the way {'into' if start + k <= reference.first else 'out of'} the run"

        remedy = "; make the excitation smaller, or record a whole period of it"
        _refuse_beyond(rig, path, limits, "be at", "rad", when, remedy)
        _refuse_fast(rig, np.diff(path, axis=0) * rate, 1.0 + 1e-9, when)


def _refuse_fast(
    rig: RigSettings, speed: NDArray, share: float, when: Callable[[int], str]
) -> None:
    """Refuse speeds (n, J), rad/s, beyond a share of the drives' limits."""
    limits = [(-share * drive.speed_rad_s, share * drive.speed_rad_s) for drive in rig.drive]
    remedy = "; make the excitation slower or smaller: is its omega_rad_s in rad/s?"
    _refuse_beyond(rig, speed, limits, "move at", "rad/s", when, remedy)


def _refuse_beyond(
    rig: RigSettings,
    values: NDArray,
    limits: Sequence[tuple[float, float]],
    verb: str,
    unit: str,
    when: Callable[[int], str],
    remedy: str,
) -> None:
    """Refuse values (n, J) outside each joint's limits, or that are no numbers."""
    for j, (drive, (low, high)) in enumerate(zip(rig.drive, limits, strict=True)):
        # Negated, so that NaN is outside.
        outside = ~((values[:, j] >= low) & (values[:, j] <= high))
        if outside.any():
            k = int(np.argmax(outside))
            raise InputError(
                f"the {drive.joint} would {verb} {values[k, j]:.3f} {unit} {when(k)}, but the rig"
                f" allows {low:g} to {high:g} {unit}{remedy}"
            )
