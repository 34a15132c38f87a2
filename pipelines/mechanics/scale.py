"""How large a machine is beside the exoskeleton's leg on which ranges and thresholds were found.

"Slow" or "a strong spring" mean something else at a servo of half a newton metre and at a ball
screw that pushes a hundred kilograms. So what is usual of an exoskeleton is multiplied by how much
more torque, speed and travel the machine's own runs have; the leg itself, whose joints are called
hip and knee, is left as it is.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar, cast

import numpy as np

from pipelines.mechanics.one_machine import refuse_several_machines
from pipelines.mechanics.run import Run
from pipelines.mechanics.units import Scale

TORQUE_NM, SPEED_RAD_S, TRAVEL_RAD = 20.0, 0.7, 1.2
"""Rms torque, rms speed and range of angles of an exoskeleton's joint in an identification run."""

Measured = TypeVar("Measured", bound=Run)


def on_one_scale(runs: Sequence[Measured]) -> list[Measured]:
    """Return runs of one machine, each with the scales of the joints in all of them.

    An exoskeleton's are left as they are, and so are runs that have their scales.

    Raises
    ------
    InputError
        Where the runs are of several machines, or of one that exoid does not know.
    """
    if runs:
        refuse_several_machines(runs)
    if not runs or runs[0].machine.is_exoskeleton or all(run.scales for run in runs):
        return list(runs)
    scales = _scales(runs)
    return [replace(cast(Any, run), scales=scales) for run in runs]


def _scales(runs: Sequence[Run]) -> tuple[Scale, ...]:
    joints, count = len(runs[0].joints), 0
    squares, low, high = np.zeros((2, joints)), np.full(joints, np.inf), np.full(joints, -np.inf)
    for run in runs:
        for piece in run.pieces(0):
            good = piece.motion.valid & np.isfinite(piece.motion.torque).all(axis=1)
            q, speed, torque = (
                x[good] for x in (piece.motion.q, piece.motion.dq, piece.motion.torque)
            )
            squares += [np.sum(torque**2, axis=0), np.sum(speed**2, axis=0)]
            count += len(q)
            low = np.minimum(low, q.min(axis=0, initial=np.inf))
            high = np.maximum(high, q.max(axis=0, initial=-np.inf))
    torque, speed = np.sqrt(squares / max(count, 1))
    # A joint that stands still, or a channel that is dead, has no scale; what refuses such runs
    # says so.
    return tuple(
        Scale(
            torque=float(torque[j]) / TORQUE_NM if torque[j] > 0 else 1.0,
            speed=float(speed[j]) / SPEED_RAD_S if speed[j] > 0 else 1.0,
            # Angles are what they are whatever the machine: a sine of them is in its equations.
            travel=float(high[j] - low[j]) / TRAVEL_RAD
            if joint.kind == "prismatic" and high[j] > low[j]
            else 1.0,
        )
        for j, joint in enumerate(runs[0].machine.joints)
    )
