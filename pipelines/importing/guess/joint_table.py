"""The tables of a joint in a map: its columns, their units, signs and zeros, each with its
reason."""

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.contracts.joints import Kind
from pipelines.importing.guess.counting import Counting, countings
from pipelines.importing.guess.joints import JointColumns
from pipelines.importing.guess.motion import TURNS, Units, counts_in_a_turn, guess_units
from pipelines.importing.guess.proposal import Proposal
from pipelines.importing.guess.register import are_whole
from pipelines.importing.guess.torque import TorqueFit, fit_torque
from pipelines.importing.sanity.plausibility import STRONGEST
from pipelines.importing.sources.source import Columns
from pipelines.settings.transmission import TARGETS
from pipelines.settings.units import UNITS

FOLLOWS = 0.7
"""Share of a torque's variance that a joint's own motion must explain before its sign is judged."""
SWINGS_RAD = 2.0
"""So far a joint must have moved before gravity tells where down is."""
HANGS_RAD = 0.15
"""So near is gravity's word to zero where the log has its zero there: friction and backlash spoil
it by that much."""

GAIN = re.compile(r"gain|^g_?(tau|f)|^k_?t(au)?$", re.IGNORECASE)
"""What logs call the gain of a drive."""


def write_joint(
    proposal: Proposal,
    number: int,
    joint: JointColumns,
    columns: Columns,
    time_s: NDArray,
    alone: bool,
    constants: Mapping[str, float],
) -> list[str]:
    """Write a joint's tables into a map; return the columns (n,) that are in them.

    ``constants`` are the log's single numbers, among which may be a drive's gain. Only of a joint
    ``alone`` does its own motion tell what its torque does: others throw it about.
    """
    where = f"joint[{number}]"
    counted = countings(joint, columns)
    logged = {
        quantity: counted[quantity].undone(columns[m.column])
        for quantity, m in joint.columns.items()
    }
    angle, velocity, full = (
        joint.columns["angle"],
        joint.columns.get("velocity"),
        counted["angle"].full,
    )
    round_in = next((unit for unit, turn in TURNS.items() if turn == full), None)
    units = guess_units(
        time_s,
        logged["angle"],
        angle.unit or round_in,
        logged.get("velocity"),
        velocity.unit if velocity else None,
    )
    if round_in and angle.unit is None:
        units = replace(units, why=f"starts anew after {full:.6g}, a turn")
    kind: Kind = "prismatic" if UNITS[units.angle].dimension == "length" else "revolute"
    proposal.table("[[joint]]", where)
    proposal.key("name", joint.name)
    why = "its unit is a length" if kind == "prismatic" else _if_it_slides(joint, units)
    proposal.key("kind", kind, why, units.why == "its name says so")
    if joint.enabled:
        proposal.key("enabled", joint.enabled, _when_off(columns[joint.enabled]))
    fit = None
    if units.angle in TURNS:
        angle_rad = logged["angle"] * UNITS[units.angle].factor
        fit = fit_torque(time_s, angle_rad, logged[joint.drive]) if joint.drive else None
    of_a_motor = _write_angle(proposal, where, joint, units, logged, time_s)
    _write_counting(proposal, counted["angle"])
    _write_zero(proposal, fit if alone else None, units)
    used = [angle.column]
    if velocity is not None:
        used.append(_write_velocity(proposal, where, joint, kind, counted, units, of_a_motor))
    used.append(
        _write_torque(
            proposal,
            where,
            joint,
            kind,
            counted,
            logged,
            fit if alone else None,
            constants,
            units.gear,
        )
    )
    used += _write_others(proposal, where, joint, kind, counted, units, of_a_motor)
    return [*used, joint.enabled] if joint.enabled else used


def _if_it_slides(joint: JointColumns, units: Units) -> str:
    """Say what else changes with the kind of a joint whose unit nothing tells."""
    if units.sure:
        return "no unit of length; prismatic where it slides"
    metric = {"angle": "m", "velocity": "m/s", "reference": "m"}
    keys = [
        f'{quantity}.unit = "{unit}"'
        for quantity, unit in metric.items()
        if quantity in joint.columns
    ]
    named = {
        "torque": 'torque.unit = "N"',
        "force": 'torque.unit = "N"',
        "current": "force_constant_n_a in place of torque_constant_nm_a",
        "voltage": "gain_n_v in place of gain_nm_v",
    }
    changed = [
        'kind = "prismatic"',
        *keys,
        *([named[joint.drive]] if joint.drive else []),
        "gravity_m_s2 = 0 if it lies level",
    ]
    return f"no unit of length; where it slides and the log is in metres: {', '.join(changed)}"


def _when_off(switch: NDArray) -> str:
    off = 1.0 - float(np.mean(np.nan_to_num(switch.astype(float))))
    said = (
        f"its name says so; 0 in {off:.1%} of the rows"
        if off
        else "its name says so; here it always is 1"
    )
    return f"{said}: where it is 0 the torque is left out"


def _write_angle(
    proposal: Proposal,
    where: str,
    joint: JointColumns,
    units: Units,
    logged: Mapping[str, NDArray],
    time_s: NDArray,
) -> bool:
    """Write an angle's table; return whether it may be that of a motor before its gear."""
    proposal.table("[joint.angle]", f"{where}.angle")
    why = joint.why.get("angle", "")
    proposal.key("column", joint.columns["angle"].column, why, "no name" not in why)
    turns = np.ptp(logged["angle"][np.isfinite(logged["angle"])]) / TURNS.get(units.angle, np.inf)
    far = f"it goes over {turns:.4g} turns, and no joint does: check its unit and gear_ratio"
    too_far = 2.0 * np.pi * turns > 2.0 * LARGEST_ANGLE_RAD
    proposal.key(
        "unit",
        units.angle,
        f"{units.why}; {far}" if too_far else units.why,
        units.sure and not too_far,
    )
    if units.angle == "counts":
        of = units.velocity and counts_in_a_turn(
            time_s, logged["angle"], logged["velocity"], units.velocity
        )
        _write_counts(
            proposal,
            "revolute",
            f"; by the velocity {of:.4g} in a turn of what that is of" if of else "",
        )
    of_a_motor = units.angle == "counts" or too_far
    if of_a_motor:
        _write_gear(proposal, "where the encoder sits on the motor")
    return of_a_motor


def _write_counting(proposal: Proposal, counted: Counting) -> None:
    if counted.bits is not None:
        why = f"whole numbers up to 2^{counted.bits}, none in the middle: its sign was lost"
        proposal.key("signed_bits", counted.bits, why)
    if counted.full is not None:
        proposal.key(
            "wraps_at",
            counted.full,
            "steps by so much from one row to the next: its counter was full",
        )


def _write_counts(proposal: Proposal, kind: Kind, hint: str = "") -> None:
    """Ask for what leads from counts to a joint."""
    if kind == "prismatic":
        proposal.unknown("counts_per_m", "counts in a metre, from the encoder's data sheet")
        return
    why = "counts in a turn of what the encoder sits on, from its data sheet"
    proposal.unknown("counts_per_turn", f"{why}{hint}; counts_per_m where it slides")


def _write_gear(proposal: Proposal, where: str = "from its data sheet", ratio: float = 1.0) -> None:
    why = f"turns of the motor for one of the joint, {where}"
    proposal.key(
        "gear_ratio",
        ratio,
        why if ratio == 1.0 else f"{why}; {ratio:g} is what the velocity tells",
        False,
    )


def _write_zero(proposal: Proposal, fit: TorqueFit | None, units: Units) -> None:
    if (
        fit is None
        or fit.explained < FOLLOWS
        or fit.gravity_share < 0.3
        or fit.reach_rad < SWINGS_RAD
    ):
        proposal.key(
            "zero",
            0.0,
            "what the log says where the joint is at zero; nothing here tells",
            sure=False,
        )
        return
    down = fit.down_rad if not fit.backwards else float(np.angle(-np.exp(1j * fit.down_rad)))
    if abs(down) < HANGS_RAD:
        proposal.key("zero", 0.0, f"gravity's torque vanishes at {down:.2f} rad: zero hangs down")
    else:
        zero = round(down * TURNS[units.angle] / (2.0 * np.pi), 3)
        proposal.key(
            "zero",
            zero,
            f"there gravity's torque says the joint would hang ({fit.explained:.0%} fits)",
            False,
        )


def _write_velocity(
    proposal: Proposal,
    where: str,
    joint: JointColumns,
    kind: Kind,
    counted: Mapping[str, Counting],
    units: Units,
    of_a_motor: bool,
) -> str:
    column = joint.columns["velocity"].column
    proposal.table("[joint.velocity]", f"{where}.velocity")
    proposal.key(
        "column",
        column,
        joint.why.get("velocity", ""),
        "no name" not in joint.why.get("velocity", ""),
    )
    proposal.key("unit", units.velocity, units.velocity_why, units.velocity_sure)
    if UNITS[units.velocity].dimension == "counts per second":
        _write_counts(proposal, kind)
    if units.velocity_sign < 0:
        proposal.key("sign", -1, "it counts the other way than the angle", sure=False)
    if of_a_motor or units.gear != 1.0:
        _write_gear(proposal, "where it is the motor's", units.gear)
    _write_counting(proposal, counted["velocity"])
    return column


def _write_torque(
    proposal: Proposal,
    where: str,
    joint: JointColumns,
    kind: Kind,
    counted: Mapping[str, Counting],
    logged: Mapping[str, NDArray],
    fit: TorqueFit | None,
    constants: Mapping[str, float],
    gear: float,
) -> str:
    drive = joint.drive
    proposal.table("[joint.torque]", f"{where}.torque")
    if drive is None:
        proposal.unknown("column", "no column's name says torque, current or voltage")
        proposal.key("unit", "N·m" if kind == "revolute" else "N")
        return ""
    found = joint.columns[drive]
    rather = joint.why.get(drive, "")
    proposal.key(
        "column",
        found.column,
        _what_torque(found.commanded, rather),
        not found.commanded and "no name" not in rather,
    )
    _write_counting(proposal, counted[drive])
    whole = are_whole(logged[drive]) if drive == "current" else counted[drive].bits is not None
    _write_torque_unit(proposal, drive, found.unit, kind, logged[drive], whole, constants, gear)
    _write_torque_sign(proposal, fit)
    return found.column


def _what_torque(commanded: bool, rather: str) -> str:
    if commanded:
        return f"commanded, not measured: it lacks the friction in the drive {rather}".strip()
    return rather


def _write_torque_unit(
    proposal: Proposal,
    drive: str,
    named: str | None,
    kind: Kind,
    values: NDArray,
    whole: bool,
    constants: Mapping[str, float],
    gear: float,
) -> None:
    dimension = UNITS[named].dimension if named else ""
    if named and dimension == "share":
        proposal.key("unit", named, "its name says so")
        proposal.unknown(
            "rated_force_n" if kind == "prismatic" else "rated_torque_nm",
            f"what {1.0 / UNITS[named].factor:g} {named} are, from the drive's settings",
        )
        _write_gear(proposal, ratio=gear)
    elif drive == "voltage":
        proposal.key("unit", named or "V", "a voltage, by its name", named is not None)
        proposal.unknown(
            "gain_n_v" if kind == "prismatic" else "gain_nm_v", _what_a_volt_does(kind, constants)
        )
    elif dimension == "current" or (not named and (drive == "current" or whole)):
        proposal.key("unit", *((named, "its name says so") if named else _unit_of_current(whole)))
        _write_motor_constant(proposal, kind)
        _write_gear(proposal, ratio=gear)
    elif dimension == "force" and kind == "revolute":
        proposal.unknown(
            "unit",
            f"{named} are of a force, and what turns a joint is a torque: is it another column?",
        )
    else:
        proposal.key("unit", *_unit_of_torque(named, kind, values))
        if dimension == "torque" and kind == "prismatic":
            proposal.unknown("lead_m", "travel for a turn of the screw, from its data sheet")


def _write_motor_constant(proposal: Proposal, kind: Kind) -> None:
    """Ask for what leads from a motor's current to its joint."""
    why = "of the motor, from its data sheet"
    if kind == "prismatic":
        proposal.unknown(
            "force_constant_n_a", f"{why}; torque_constant_nm_a and lead_m where it turns a screw"
        )
    else:
        proposal.unknown("torque_constant_nm_a", f"{why}; force_constant_n_a where it slides")


def _unit_of_current(whole: bool) -> tuple[str, str, bool]:
    """Return the unit of a current whose name tells none, why, and that it is not sure."""
    return (
        ("mA", "whole numbers, as drives tell mA", False)
        if whole
        else ("A", "no name says its unit; SI assumed", False)
    )


def _unit_of_torque(named: str | None, kind: Kind, values: NDArray) -> tuple[str, str, bool]:
    """Return the unit of a torque or force, why, and whether it is sure; doubt one in which no
    drive is so strong."""
    quantity, si = ("torque", "N·m") if kind == "revolute" else ("force", "N")
    unit, why = (named, "its name says so") if named else (si, "no name says its unit; SI assumed")
    reach = float(np.nanquantile(np.abs(values), 0.99)) * UNITS[unit].factor
    if reach <= STRONGEST[quantity]:
        return unit, why, named is not None
    return unit, f"{why}, but no joint's drive delivers {reach:.4g} {si}: is it m{si}?", False


def _what_a_volt_does(kind: Kind, constants: Mapping[str, float]) -> str:
    """Say where the gain of an amplifier is to be had, and what it is called where the joint slides
    after all."""
    held = [f"{name} = {value:.6g}" for name, value in constants.items() if GAIN.search(name)]
    found = f"perhaps {held[0]}, which the log holds" if held else "from the amplifier"
    return f"what a volt does, {found}" + (
        "; gain_n_v where it slides" if kind == "revolute" else ""
    )


def _write_torque_sign(proposal: Proposal, fit: TorqueFit | None) -> None:
    if fit is None:
        proposal.key(
            "sign",
            1,
            "positive torque must accelerate the angle upward; not to be seen here",
            sure=False,
        )
    elif fit.explained < FOLLOWS:
        proposal.key(
            "sign",
            1,
            f"the motion explains {max(0.0, fit.explained):.0%} of the torque only",
            sure=False,
        )
    elif fit.backwards:
        proposal.key(
            "sign",
            -1,
            f"turned, it accelerates the joint and feeds its friction ({fit.explained:.0%} fits)",
        )
    elif fit.inertia > 0.0 and fit.friction > 0.0:
        proposal.key(
            "sign", 1, f"accelerates the joint and feeds its friction ({fit.explained:.0%} fits)"
        )
    else:
        proposal.key("sign", 1, "inertia and friction disagree about it", sure=False)


def _write_others(
    proposal: Proposal,
    where: str,
    joint: JointColumns,
    kind: Kind,
    counted: Mapping[str, Counting],
    units: Units,
    of_a_motor: bool,
) -> list[str]:
    used = []
    for quantity, usual in (("reference", units.angle), ("temperature", "°C")):
        if quantity in joint.columns:
            found = joint.columns[quantity]
            proposal.table(f"[joint.{quantity}]", f"{where}.{quantity}")
            proposal.key("column", found.column, joint.why.get(quantity, ""))
            fits = (TARGETS[quantity][kind], "counts")
            named = found.unit is not None and UNITS[found.unit].dimension in fits
            unit = found.unit if found.unit is not None and named else usual
            proposal.key("unit", unit, "its name says so" if named else "as is usual", named)
            if unit == "counts":
                _write_counts(proposal, kind)
            # A drive is told where to go in the counts of its own encoder, and in turns of what
            # that sits on.
            if quantity == "reference" and of_a_motor and unit == units.angle:
                _write_gear(proposal, "where it is the motor's")
            _write_counting(proposal, counted[quantity])
            used.append(found.column)
    return used
