"""The runs that a diagnosis is given: of one hip and knee, whose joints move for long enough to say anything."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import joints_of
from pipelines.errors import InputError
from pipelines.estimation.regression import REVERSAL_SPEED, away_from_reversals
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.one_machine import refuse_several_machines

JOINTS = ("hip", "knee")
"""Both revolute: what the rigid body of the baseline and the effects of the catalogue are written for."""
MOST_NM = 10_000.0
LEAST_S = 5.0
"""Of motion, all runs of a kind and purpose together; below, gravity, inertia and friction are not told apart."""


def refuse_unfit(motions: Sequence[Motion]) -> None:
    """Refuse motions that no diagnosis can be made of, or it would be one of noise."""
    for motion in motions:
        found = [f"{joint.name} ({joint.kind})" for joint in joints_of(motion.metadata)]
        if found != [f"{joint} (revolute)" for joint in JOINTS]:
            raise InputError(
                f"{motion.file} has joints {', '.join(found)}, expected hip and knee in this order, both revolute: "
                "the causes are written for a leg of these two; use `exoid identify` for other machines"
            )
        _refuse_monsters(motion)
    refuse_several_machines(motions)
    _refuse_twins(motions)
    for purpose, run in sorted({(m.purpose, m.run) for m in motions}):
        _refuse_standstill([m for m in motions if (m.purpose, m.run) == (purpose, run)])


def _refuse_monsters(motion: Motion) -> None:
    """Refuse torques that no leg's drive makes."""
    for j, joint in enumerate(JOINTS):
        largest = float(np.nanmax(np.abs(motion.torque[:, j])))
        if largest > MOST_NM:
            raise InputError(
                f"{motion.file}: the {joint} torque reaches {largest:.3g} N·m, expected at most {MOST_NM:g} N·m; "
                "correct torque constant, gear ratio or the unit of the current in the rig file, or the recording"
            )


def _refuse_twins(motions: Sequence[Motion]) -> None:
    """Refuse one measurement under two names: an error would pass for one of a run that no fit has seen."""
    for one, other in combinations(motions, 2):
        if np.array_equal(one.q, other.q) and np.array_equal(one.torque, other.torque):
            raise InputError(
                f"{other.file} ({other.run}, {other.purpose}) holds the same torques and angles as {one.file} "
                f"({one.run}, {one.purpose}), expected a measurement of its own in each; give each run once"
            )


def _refuse_standstill(motions: Sequence[Motion]) -> None:
    """Refuse runs of one kind and purpose in which a joint hardly moves or both hardly move at once."""
    files = ", ".join(m.file for m in motions)
    together = f"in the {motions[0].run} runs to {motions[0].purpose} together"
    moving = [away_from_reversals(m) & m.valid[:, np.newaxis] for m in motions]
    for j, joint in enumerate(JOINTS):
        if (lasts := _seconds(motions, [m[:, j] for m in moving])) < LEAST_S:
            raise InputError(
                f"{files}: the {joint} moves for {lasts:.1f} s (faster than {REVERSAL_SPEED:g} rad/s and away from "
                f"reversals), expected {LEAST_S:g} s {together}; "
                "excite both joints, or record longer; if it did move, check its encoder"
            )
    if (lasts := _seconds(motions, [m.all(axis=1) for m in moving])) < LEAST_S:
        raise InputError(
            f"{files}: hip and knee move at once for {lasts:.1f} s, expected {LEAST_S:g} s {together}: "
            "errors are scored there; excite both joints at the same time, or record longer"
        )


def _seconds(motions: Sequence[Motion], marked: Sequence[NDArray]) -> float:
    return float(sum(mask.sum() / motion.sample_rate_hz for mask, motion in zip(marked, motions, strict=True)))
