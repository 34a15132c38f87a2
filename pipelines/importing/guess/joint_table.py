"""The tables of a joint in a map: its columns, their units, signs and zeros, each with a reason."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.contracts.joint_units import Kind
from pipelines.importing.guess.continuity import crosses_zero, is_continuous
from pipelines.importing.guess.counting import Counting, countings
from pipelines.importing.guess.joints import JointColumns
from pipelines.importing.guess.motion import FROM_NAME, TURNS, Units, guess_units
from pipelines.importing.guess.own_clocks import OwnClock
from pipelines.importing.guess.proposal import Proposal
from pipelines.importing.guess.torque import TorqueFit, fit_torque
from pipelines.importing.naming.meaning import of_motor
from pipelines.importing.quantities.numbers import are_whole
from pipelines.importing.sanity.plausibility import STRONGEST
from pipelines.importing.sources.source import Columns
from pipelines.settings.transmission import dimension_at
from pipelines.settings.units import UNITS


def write_joint(
    proposal: Proposal,
    number: int,
    joint: JointColumns,
    columns: Columns,
    time_s: NDArray,
    alone: bool,
    clocks: Mapping[str, OwnClock],
    limits: Mapping[str, list[float]],
) -> list[str]:
    """Write a joint's tables into a map.

    Parameters
    ----------
    proposal : Proposal
        The map.
    number : int
        Index of the joint.
    joint : JointColumns
        The joint's columns by quantity.
    columns : mapping of str to (n,) array
        Columns of the log.
    time_s : (n,) array
        Times, s.
    alone : bool
        Whether it is the only joint. Motions of other joints would disturb a fit of its torque.
    clocks : mapping of str to OwnClock
        Clocks of columns that have one of their own.
    limits : mapping of str to list of float
        Lowest and highest reading of columns with a value for missing ones.

    Returns
    -------
    list of str
        The columns that are in the tables.
    """
    counters = countings(joint, columns)
    logged = {
        quantity: counters[quantity].undone(columns[m.column])
        for quantity, m in joint.columns.items()
    }
    units = _units(joint, logged, time_s, counters["angle"].full)
    kind: Kind = "prismatic" if UNITS[units.angle].dimension == "length" else "revolute"
    fit = None
    if alone and joint.drive and units.angle in TURNS:
        fit = fit_torque(time_s, logged["angle"] * UNITS[units.angle].factor, logged[joint.drive])
    writer = _JointWriter(
        proposal, f"joint[{number}]", joint, counters, logged, units, kind, clocks, limits
    )
    writer.write_head(columns)
    writer.write_angle(fit)
    if "velocity" in joint.columns:
        writer.write_velocity()
    writer.write_torque(fit)
    writer.write_others()
    return writer.used


def _units(
    joint: JointColumns, logged: Mapping[str, NDArray], time_s: NDArray, full: float | None
) -> Units:
    """Return the units of a joint's angle and velocity; an angle may wrap around after a turn."""
    angle, velocity = joint.columns["angle"], joint.columns.get("velocity")
    of_turn = next((unit for unit, turn in TURNS.items() if turn == full), None)
    units = guess_units(
        time_s,
        logged["angle"],
        angle.unit or of_turn,
        logged.get("velocity"),
        velocity.unit if velocity else None,
        angle.doubt,
    )
    if of_turn and angle.unit is None:
        return replace(units, why=f"wraps around after {full:.6g}, a turn")
    return units


@dataclass
class _JointWriter:
    """Writes the tables of one joint."""

    proposal: Proposal
    where: str
    joint: JointColumns
    counters: Mapping[str, Counting]
    logged: Mapping[str, NDArray]
    units: Units
    kind: Kind
    clocks: Mapping[str, OwnClock]
    limits: Mapping[str, list[float]]

    def __post_init__(self) -> None:
        self.used: list[str] = []
        angle = self.logged["angle"]
        turn = TURNS.get(self.units.angle, np.inf)
        self.turns = float(np.ptp(angle[np.isfinite(angle)]) / turn)
        # A range against twice the largest angle, which holds to either side of zero.
        self.too_far = 2.0 * np.pi * self.turns > 2.0 * LARGEST_ANGLE_RAD
        # The angle may then be that of a motor, before its gear.
        self.may_be_motor = self.units.angle == "counts" or self.too_far

    @property
    def slides(self) -> bool:
        return self.kind == "prismatic"

    def write_head(self, columns: Columns) -> None:
        """Write name, kind and the switch of the drive."""
        self.proposal.table("[[joint]]", self.where)
        self.proposal.key("name", self.joint.name)
        why = "its unit is a length" if self.slides else self._if_it_slides()
        self.proposal.key("kind", self.kind, why, self.units.why == FROM_NAME)
        if self.too_far:
            why = f"{self.turns:.4g} turns; remove it if another unit or gear_ratio is right"
            self.proposal.key("turns", True, why, sure=False)
        if self.joint.zero_torque:
            self.used.append(self.joint.zero_torque)
            why = f"{self.joint.zero_torque} is 0 throughout, as of a passive joint"
            self.proposal.key("drive", "none", why, sure=False)
        if self.joint.enabled:
            self.used.append(self.joint.enabled)
            self.proposal.key("enabled", self.joint.enabled, _when_off(columns[self.joint.enabled]))

    def write_angle(self, fit: TorqueFit | None) -> None:
        """Write the table of the angle; a fit of the torque shows its zero."""
        self._write_column("angle")
        why, sure = self.units.why, self.units.sure
        if not is_continuous(self.logged["angle"]):
            why += "; jumps from row to row, as no motion does: outliers, or an unknown encoding"
            sure = False
        if self.too_far:
            why += f"; {self.turns:.4g} turns, so check unit and gear_ratio"
            sure = False
        self.proposal.key("unit", self.units.angle, why + self._unread("angle", "; "), sure)
        if self.units.angle == "counts":
            counts = self.units.counts_in_turn
            self._write_counts(f"; by the velocity {counts:.4g} in its turn" if counts else "")
        if self.may_be_motor or self._is_of_motor("angle", self.joint.drive):
            self._write_gear("if the encoder sits on the motor")
        self._write_counting("angle")
        self._write_zero(fit)

    def write_velocity(self) -> None:
        """Write the table of the velocity."""
        self._write_column("velocity")
        units = self.units
        why = units.velocity_why + ("" if units.velocity_sure else self._unread("velocity", "; "))
        doubt = self.joint.columns["velocity"].doubt
        why += f"; {doubt}" if doubt else ""
        self.proposal.key("unit", units.velocity, why, units.velocity_sure and not doubt)
        if UNITS[units.velocity].dimension == "counts per second":
            self._write_counts()
        if units.velocity_sign < 0:
            self.proposal.key("sign", -1, "opposite to the angle", sure=False)
        if self.may_be_motor or units.gear != 1.0:
            self._write_gear("if it is the motor's", units.gear)
        self._write_counting("velocity")

    def write_torque(self, fit: TorqueFit | None) -> None:
        """Write the table of torque or force."""
        drive = self.joint.drive
        if self.joint.zero_torque:
            return
        if drive is None:
            self.proposal.table("[joint.torque]", f"{self.where}.torque")
            self.proposal.unknown(
                "column",
                "no column is named torque, current or voltage; if none was recorded, remove this"
                ' table, and set drive = "unmeasured" next to the name',
            )
            self.proposal.key("unit", "N" if self.slides else "N·m")
            return
        commanded = self.joint.columns[drive].commanded
        remark = "commanded, not measured, so without the drive's friction" if commanded else ""
        self._write_column(drive, "torque", remark)
        self._write_counting(drive)
        self._write_torque_unit(drive)
        self._write_torque_sign(fit)

    def write_others(self) -> None:
        """Write the tables of set-point and temperature."""
        for quantity, usual in (("reference", self.units.angle), ("temperature", "°C")):
            meaning = self.joint.columns.get(quantity)
            if meaning is None:
                continue
            self.used.append(meaning.column)
            self.proposal.table(f"[joint.{quantity}]", f"{self.where}.{quantity}")
            why = self.joint.why.get(quantity, "")
            self.proposal.key("column", meaning.column, why, quantity not in self.joint.doubtful)
            self._write_clock(meaning.column)
            dimensions = (dimension_at(self.kind, quantity), "counts")
            if meaning.unit is not None and UNITS[meaning.unit].dimension in dimensions:
                unit = meaning.unit
                why = "; ".join(filter(None, (FROM_NAME, meaning.doubt)))
                self.proposal.key("unit", unit, why, not meaning.doubt)
            else:
                unit = usual
                why = f"as is usual{self._unread(quantity, '; ')}"
                self.proposal.key("unit", unit, why, sure=False)
            if unit == "counts":
                self._write_counts()
            # Set-points are in the counts and turns of the drive's own encoder.
            if quantity == "reference" and self.may_be_motor and unit == self.units.angle:
                self._write_gear("if it is the motor's")
            self._write_counting(quantity)

    def _if_it_slides(self) -> str:
        """Return the keys that change if a joint of unknown unit slides."""
        if self.units.sure:
            return "no unit of length; prismatic if it slides"
        metric = {"angle": "m", "velocity": "m/s", "reference": "m"}
        of_drive = {
            "torque": 'torque.unit = "N"',
            "force": 'torque.unit = "N"',
            "current": "force_constant_n_a in place of torque_constant_nm_a",
            "voltage": "gain_n_v in place of gain_nm_v",
        }
        changes = ['kind = "prismatic"']
        changes += [f'{q}.unit = "{unit}"' for q, unit in metric.items() if q in self.joint.columns]
        if self.joint.drive:
            changes.append(of_drive[self.joint.drive])
        changes.append("gravity_m_s2 = 0 if it lies level")
        return f"no unit of length; if it slides and the log is in metres: {', '.join(changes)}"

    def _write_column(self, quantity: str, table: str = "", remark: str = "") -> None:
        column, why = self.joint.columns[quantity].column, self.joint.why.get(quantity, "")
        limits = self.limits.get(column)
        self.used.append(column)
        table = table or quantity
        self.proposal.table(f"[joint.{table}]", f"{self.where}.{table}")
        reason = ", ".join(filter(None, (remark, why)))
        self.proposal.key(
            "column", column, reason, not remark and quantity not in self.joint.doubtful
        )
        self._write_clock(column)
        if limits is not None:
            why = "outside lies one value, far from all others, as for missing readings"
            self.proposal.key("range", limits, why, sure=False)

    def _write_clock(self, column: str) -> None:
        if column not in self.clocks:
            return
        clock = self.clocks[column]
        self.proposal.key("time", clock.column, "sampled by a clock of its own")
        if not clock.as_log:
            self.proposal.key("time_unit", clock.unit)
            if clock.scale != 1.0:
                self.proposal.key("time_scale", clock.scale)
        if clock.offset_s:
            why = "if both clocks began together: no stamp of one is a stamp of the other"
            self.proposal.key("time_offset_s", clock.offset_s, why, sure=False)

    def _write_counting(self, quantity: str) -> None:
        counter = self.counters[quantity]
        if counter.bits is not None:
            why = f"whole numbers up to 2^{counter.bits}, none in the middle: its sign was lost"
            sure = crosses_zero(self.logged[quantity])
            why += "" if sure else "; but it jumps where the sign changes: another encoding?"
            self.proposal.key("signed_bits", counter.bits, why, sure)
        if counter.sign is not None:
            why = f"a magnitude, and {2**counter.sign} more where negative: then it has no jumps"
            self.proposal.key("sign_bit", counter.sign, why, sure=False)
        if counter.full is not None:
            why = "steps by so much from one row to the next: its counter wraps around"
            self.proposal.key("wraps_at", counter.full, why)

    def _write_counts(self, hint: str = "") -> None:
        """Ask for the counts of an encoder."""
        if self.slides:
            why = "counts in a metre, from the encoder's data sheet"
            self.proposal.unknown("counts_per_m", why)
            return
        why = "counts in a turn of the encoder's shaft, from its data sheet"
        self.proposal.unknown("counts_per_turn", f"{why}{hint}; counts_per_m if it slides")

    def _write_gear(self, where: str = "from its data sheet", ratio: float = 1.0) -> None:
        why = f"turns of the motor for one of the joint, {where}"
        if ratio != 1.0:
            why += f"; {ratio:g} by the velocity"
        self.proposal.key("gear_ratio", ratio, why, sure=False)

    def _is_of_motor(self, quantity: str, other: str | None) -> bool:
        """Return whether the name of one quantity says the motor, and that of another does not."""
        return (
            other is not None
            and of_motor(self.joint.columns[quantity].column)
            and not of_motor(self.joint.columns[other].column)
        )

    def _write_zero(self, fit: TorqueFit | None) -> None:
        # Least reach of a joint from which gravity shows the direction down.
        swings_rad = 2.0
        # Error of that direction by friction and backlash; within it the log's zero hangs down.
        hangs_rad = 0.15
        # With little gravity in the torque, its direction is an error of the other terms.
        shows_gravity = (
            fit is not None
            and fit.proves
            and fit.gravity_share >= 0.3
            and fit.reach_rad >= swings_rad
        )
        if fit is None or not shows_gravity:
            why = "reading where the joint is at zero"
            if self.where != "joint[0]" and not self.slides:
                why += "; if it counts from the vertical, subtract the angle of the joint before it"
            self.proposal.key("zero", 0.0, why, sure=False)
            return
        # A torque of the wrong sign makes gravity point upward.
        down = float(np.angle(-np.exp(1j * fit.down_rad))) if fit.backwards else fit.down_rad
        if abs(down) < hangs_rad:
            why = f"gravity's torque vanishes at {down:.2f} rad: zero hangs down"
            self.proposal.key("zero", 0.0, why, self.units.sure)
            return
        zero = round(down * TURNS[self.units.angle] / (2.0 * np.pi), 3)
        why = f"by gravity's torque the joint would hang there ({fit.explained:.0%} fits)"
        self.proposal.key("zero", zero, why, sure=False)

    def _write_torque_unit(self, drive: str) -> None:
        named = self.joint.columns[drive].unit
        dimension = UNITS[named].dimension if named else ""
        lost_sign = self.counters[drive].bits is not None
        # Drives log currents as whole mA. Another column without a unit counts as such a register
        # only if its sign was lost.
        whole = are_whole(self.logged[drive]) if drive == "current" else lost_sign
        if named and dimension == "share":
            self.proposal.key("unit", named, FROM_NAME)
            self.proposal.unknown(
                "rated_force_n" if self.slides else "rated_torque_nm",
                f"value of {1.0 / UNITS[named].factor:g} {named}, from the drive's settings",
            )
            self._write_gear(ratio=self.units.gear)
        elif drive == "voltage":
            self.proposal.key("unit", named or "V", "a voltage, by its name", named is not None)
            if self.slides:
                self.proposal.unknown("gain_n_v", "force for a volt, from the amplifier")
            else:
                why = "torque for a volt, from the amplifier; gain_n_v if it slides"
                self.proposal.unknown("gain_nm_v", why)
        elif dimension == "current" or (not named and (drive == "current" or whole)):
            if named:
                self.proposal.key("unit", named, FROM_NAME)
            elif whole:
                why = "whole numbers, as drives log mA"
                self.proposal.key("unit", "mA", why, sure=False)
            else:
                self.proposal.key("unit", "A", self._assumed(drive), sure=False)
            self._write_motor_constant()
            self._write_gear(ratio=self.units.gear)
        elif dimension == "force" and not self.slides:
            why = f"{named} is a unit of force, but a joint that turns needs a torque"
            self.proposal.unknown("unit", f"{why}: is it another column?")
        else:
            self.proposal.key("unit", *self._unit_of_torque(named, self.logged[drive]))
            if self._is_of_motor(drive, "angle"):
                self._write_gear("if the torque is the motor's")
            if dimension == "torque" and self.slides:
                why = "travel for a turn of the screw, from its data sheet"
                self.proposal.unknown("lead_m", why)

    def _write_motor_constant(self) -> None:
        """Ask for torque or force per ampere."""
        why = "of the motor, from its data sheet"
        if self.slides:
            why += "; torque_constant_nm_a and lead_m if it turns a screw"
            self.proposal.unknown("force_constant_n_a", why)
        else:
            why += "; force_constant_n_a if it slides"
            self.proposal.unknown("torque_constant_nm_a", why)

    def _unit_of_torque(self, named: str | None, values: NDArray) -> tuple[str, str, bool]:
        """Return the unit of a torque or force, why, and whether a drive can be that strong."""
        quantity, si = ("force", "N") if self.slides else ("torque", "N·m")
        drive = self.joint.drive or quantity
        unit, why = (named, FROM_NAME) if named else (si, self._assumed(drive))
        # A quantile, so that an outlier does not change the unit.
        reach = float(np.nanquantile(np.abs(values), 0.99)) * UNITS[unit].factor
        if reach <= STRONGEST[quantity]:
            return unit, why, named is not None
        return unit, f"{why}, but {reach:.4g} {si} is too much for a drive: is it m{si}?", False

    def _assumed(self, quantity: str) -> str:
        """Return why the unit of a quantity is SI where its column's name gives none."""
        return self._unread(quantity) or "no name has its unit; SI assumed"

    def _unread(self, quantity: str, before: str = "") -> str:
        """Return what to set for a unit that no map has, in a column's name; empty without one."""
        text = self.joint.columns[quantity].unread
        return f"{before}its name says {text!r}: set unit and scale by that" if text else ""

    def _write_torque_sign(self, fit: TorqueFit | None) -> None:
        sign, sure = 1, False
        if fit is None:
            why = "positive torque must accelerate the angle upward; not visible in this log"
        elif not fit.proves:
            why = f"the motion explains {max(0.0, fit.explained):.0%} of the torque"
            why += f", and {max(0.0, fit.rival):.0%} of one shifted in time"
        elif fit.backwards:
            sign, sure = -1, True
            why = "reversed, it accelerates the joint and overcomes its friction"
            why += f" ({fit.explained:.0%} fits)"
        elif fit.inertia > 0.0 and fit.friction > 0.0:
            sure = True
            why = "accelerates the joint and overcomes its friction"
            why += f" ({fit.explained:.0%} fits)"
        else:
            why = "inertia and friction disagree about it"
        # The motion of another joint explains a torque, too, often with the opposite sign.
        if sure and self.joint.drive in self.joint.doubtful:
            sure = False
            why += ", if this is the joint's torque"
        self.proposal.key("sign", sign, why, sure)


def _when_off(switch: NDArray) -> str:
    off = 1.0 - float(np.mean(np.nan_to_num(switch.astype(float))))
    share = f"0 in {off:.1%} of the rows" if off else "here always 1"
    return f"{FROM_NAME}; {share}: where it is 0 the torque is left out"
