"""Check that the runs of a diagnosis are of one machine whose joints move for long enough."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import the
from pipelines.errors import InputError
from pipelines.estimation.regression import away_from_reversals, moves, reversal_speeds
from pipelines.mechanics.constant_torque import constant_torque
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.remedies import AT_REST, settings_of
from pipelines.mechanics.run import refuse_several_machines


def refuse_unfit(motions: Sequence[Motion]) -> None:
    """Refuse motions that no diagnosis can use.

    Parameters
    ----------
    motions : sequence of Motion
        Runs of a session.

    Raises
    ------
    InputError
        Names the file: another machine, one angle twice, the same data twice, or a standstill.
    """
    refuse_several_machines(motions)
    for motion in motions:
        # Other machines may be of any size, so no torque is too large for them.
        if motion.machine.is_exoskeleton:
            _refuse_monsters(motion)
        _refuse_one_angle_twice(motion)
    _refuse_twins(motions)
    for purpose, run in sorted({(m.purpose, m.run) for m in motions}):
        of_kind = [m for m in motions if (m.purpose, m.run) == (purpose, run)]
        _refuse_standstill(of_kind, motions)


def _refuse_monsters(motion: Motion) -> None:
    """Raise InputError for torques that no leg's drive makes."""
    # Largest plausible torque, N·m; a larger one is in another unit.
    most_nm = 10_000.0
    for j, joint in enumerate(motion.joints):
        largest = float(np.nanmax(np.abs(motion.torque[:, j])))
        if largest > most_nm:
            raise InputError(
                f"{motion.file}: the {joint} torque reaches {largest:.3g} N·m, expected at most"
                f" {most_nm:g} N·m; correct torque constant, gear ratio or the unit of the current"
                f" in {settings_of(motion)}, or the recording"
            )


def _refuse_one_angle_twice(motion: Motion) -> None:
    """Raise InputError where one joint's angle copies another's.

    No motion separates the torques of such joints.
    """
    if motion.measured_angle is None or not motion.valid.any():
        return
    q = motion.measured_angle[motion.valid]
    # A constant has no correlation, and a standstill has a message of its own.
    moving = np.flatnonzero(np.ptp(q, axis=0) > 0.0)
    # Largest shortfall of a correlation from 1 by rounding. Two encoders differ by more than
    # their last count.
    rounding = 1e-12
    for one, other in combinations(moving, 2):
        alike = float(np.corrcoef(q[:, one], q[:, other])[0, 1])
        if abs(alike) > 1.0 - rounding:
            times = alike * np.ptp(q[:, other]) / np.ptp(q[:, one])
            first, second = motion.joints[one], motion.joints[other]
            raise InputError(
                f"{motion.file}: {the(second)}'s angle is a copy of {the(first)}'s (factor"
                f" {times:.4g}), expected an encoder column for each joint; correct their columns"
                f" in {settings_of(motion)}"
            )


def _refuse_twins(motions: Sequence[Motion]) -> None:
    """Raise InputError for one measurement under two names."""
    # A copy's error would count as that of a run that no fit has seen. Dead channels are alike too,
    # and have a message of their own.
    varying = [motion for motion in motions if np.ptp(motion.torque, axis=0).any()]
    for one, other in combinations(varying, 2):
        if np.array_equal(one.q, other.q) and np.array_equal(one.torque, other.torque):
            raise InputError(
                f"{other.file} ({other.run}, {other.purpose}) holds the same torques and angles as"
                f" {one.file} ({one.run}, {one.purpose}), expected different measurements; give"
                " each run once"
            )


def _refuse_standstill(motions: Sequence[Motion], session: Sequence[Motion]) -> None:
    """Raise InputError where the joints of one kind and purpose move too little.

    Each joint must move for long enough, and all of them at once. The whole session shows whether
    one that rests here moves in other runs.
    """
    files = ", ".join(m.file for m in motions)
    together = f"in the {motions[0].run} runs to {motions[0].purpose} together"
    moving = [away_from_reversals(m) & m.valid[:, np.newaxis] for m in motions]
    machine = motions[0].machine
    # Least motion of an exoskeleton, s, all runs of a kind and purpose together. Less does not
    # separate gravity, inertia and friction.
    least_s = 5.0
    least = machine.lasting(least_s)
    for j, joint in enumerate(machine.joints):
        # One whose torque was not measured may rest.
        if not joint.is_measured:
            continue
        # First: a constant angle is the reason why a joint seems not to move.
        _refuse_dead_angle(motions, j, session)
        lasts = _seconds(motions, [m[:, j] for m in moving])
        if lasts < least:
            simpler = _simpler(motions, j, session) if lasts == 0.0 else ""
            raise InputError(
                f"{files}: {the(joint.name)} moves for {_rounded_down(lasts):.1f} s (faster than"
                f" {reversal_speeds(machine)[j]:.2g} {joint.unit('velocity')} and away from"
                f" reversals), expected {least:.2g} s {together}; excite"
                f" {('it', 'both joints', 'all joints')[min(len(machine.joints), 3) - 1]}, or"
                f" record longer{simpler}. If it did move, check its encoder, and the units of"
                f" angle and time in {settings_of(motions[0])}"
            )
        _refuse_dead_torque(motions, j)
    # Least time for which all joints of an exoskeleton move at once, s: errors are scored there.
    together_s = 2.0
    least = machine.lasting(together_s)
    lasts = _seconds(motions, [m[:, machine.measured].all(axis=1) for m in moving])
    if lasts < least:
        raise InputError(
            f"{files}: {' and '.join(machine.measured_names)} move at once for"
            f" {_rounded_down(lasts):.1f} s, expected {least:.2g} s {together}: errors are"
            " scored there; excite both joints at the same time, or record longer"
        )


def _rounded_down(seconds: float) -> float:
    """Return seconds rounded down to a tenth, so that a time that is too short looks so."""
    return int(10.0 * seconds) / 10.0


def _refuse_dead_torque(motions: Sequence[Motion], joint: int) -> None:
    """Raise InputError for a torque that is constant while its joint moves."""
    here = motions[0].machine.joints[joint]
    values = np.concatenate([m.torque[m.valid, joint] for m in motions])
    if len(values) and np.ptp(values) == 0.0 and here.has_sensor:
        # Adding zero turns a -0.0 into 0.0 in the message.
        raise constant_torque(motions, here, float(values[0]) + 0.0)


def _refuse_dead_angle(motions: Sequence[Motion], joint: int, session: Sequence[Motion]) -> None:
    """Raise InputError for a constant angle; after the filter it only seems to move."""
    measured = [m.measured_angle[m.valid, joint] for m in motions if m.measured_angle is not None]
    values = np.concatenate(measured) if measured else np.zeros(0)
    if len(values) and np.ptp(values) == 0.0:
        here = motions[0].machine.joints[joint]
        raise InputError(
            f"{', '.join(m.file for m in motions)}: the angle of {the(here.name)} is"
            f" {values[0]:.4g} {here.unit('angle')} in every row, expected a joint that moves;"
            f" check its encoder, and which channel {settings_of(motions[0])} reads"
            f"{_simpler(motions, joint, session)}"
        )


def _simpler(motions: Sequence[Motion], joint: int, session: Sequence[Motion]) -> str:
    """Return the way out for a blocked joint of several.

    If it moves in no run of the session, the others are a simpler machine.
    """
    if len(motions[0].joints) < 2:
        return ""
    others = (m for m in session if not any(m is one for one in motions))
    moves_in = next((m.file for m in others if moves(m)[joint]), None)
    if moves_in is None:
        return f"; {AT_REST}"
    purpose = "train" if motions[0].purpose == "train" else "validate"
    return f", or {purpose} on a run in which it moves, as in {moves_in}"


def _seconds(motions: Sequence[Motion], marked: Sequence[NDArray]) -> float:
    return float(
        sum(
            mask.sum() / motion.sample_rate_hz for mask, motion in zip(marked, motions, strict=True)
        )
    )
