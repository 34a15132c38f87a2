"""The size of a machine relative to the exoskeleton's leg of the standard thresholds.

"Slow" or "a strong spring" differ between a servo of half a newton metre and a ball screw that
pushes a hundred kilograms. So the usual values of an exoskeleton are multiplied by the ratios of
torque, speed and travel in the machine's own runs. The leg itself, whose joints are called hip and
knee, keeps its values.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar, cast

import numpy as np

from pipelines.contracts.joint_units import Scale
from pipelines.mechanics.run import Run, refuse_several_machines

Measured = TypeVar("Measured", bound=Run)


def on_one_scale(runs: Sequence[Measured]) -> list[Measured]:
    """Return runs of one machine with the scales of its joints in all of them.

    Runs of an exoskeleton, and runs that have scales, are returned unchanged.

    Raises
    ------
    InputError
        If the runs are of several machines, or of an unknown one.
    """
    if runs:
        refuse_several_machines(runs)
    if not runs or runs[0].machine.is_exoskeleton or all(run.scales for run in runs):
        return list(runs)
    # All runs share the scales. Otherwise one effect would have another range in each run.
    scales = _scales(runs)
    return [replace(cast(Any, run), scales=scales) for run in runs]


def _scales(runs: Sequence[Run]) -> tuple[Scale, ...]:
    # Rms torque, rms speed and range of angles of an exoskeleton's joint in an identification run.
    torque_nm, speed_rad_s, travel_rad = 20.0, 0.7, 1.2
    joints, count = len(runs[0].joints), 0
    squares, low, high = np.zeros((2, joints)), np.full(joints, np.inf), np.full(joints, -np.inf)
    for run in runs:
        for piece in run.pieces(0):
            good = piece.motion.valid & np.isfinite(piece.motion.torque).all(axis=1)
            motion = piece.motion
            q, speed, torque = motion.q[good], motion.dq[good], motion.torque[good]
            squares += [np.sum(torque**2, axis=0), np.sum(speed**2, axis=0)]
            count += len(q)
            low = np.minimum(low, q.min(axis=0, initial=np.inf))
            high = np.maximum(high, q.max(axis=0, initial=-np.inf))
    torque, speed = np.sqrt(squares / max(count, 1))
    # A joint at rest or a dead channel has no scale; such runs are refused elsewhere.
    # Angles do not scale with the machine, because its equations contain their sines.
    slides = np.array([joint.kind == "prismatic" for joint in runs[0].machine.joints])
    travel = np.where(slides & (high > low), (high - low) / travel_rad, 1.0)
    # A passive joint's torque is zero; its links are those that the weakest drive moves.
    driven = torque[torque > 0]
    torque = np.where(torque > 0, torque, driven.min() if len(driven) else torque_nm)
    torque = torque / torque_nm
    # A joint whose torque was not measured may rest; its encoder's noise is no scale of speed.
    measured = runs[0].machine.measured
    speed = np.where(measured, speed, np.maximum(speed, speed[measured].min()))
    speed = np.where(speed > 0, speed / speed_rad_s, 1.0)
    return tuple(Scale(*row) for row in np.column_stack([torque, speed, travel]).tolist())
