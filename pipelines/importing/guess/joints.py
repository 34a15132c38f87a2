"""Group columns by joint, and choose those of its angle, velocity and torque."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.guess.torque import fit_torque
from pipelines.importing.naming.meaning import RUNS, SIDES, STATISTICS, Meaning, derived, in_counts
from pipelines.importing.quantities.consistency import integral_agreement, likeliest_integrals
from pipelines.importing.quantities.numbers import are_whole
from pipelines.settings.units import UNITS

# A torque needs no further constant; a current or voltage is proportional to it.
TURNING = ("torque", "current", "force", "voltage")
"""Quantities that show the torque of a revolute joint's drive, the best first."""


@dataclass(frozen=True)
class JointColumns:
    """The columns of one joint, by the quantities that the log has."""

    name: str
    columns: Mapping[str, Meaning]
    why: Mapping[str, str]
    """Reasons for columns that were not chosen by name alone."""
    doubtful: frozenset[str] = frozenset()
    """Quantities whose column may be another one."""
    enabled: str | None = None
    """Column that is 1 while its drive is on, else 0."""
    zero_torque: str | None = None
    """Column of a torque or current that is 0 throughout, where it has no other."""

    @property
    def drive(self) -> str | None:
        """The quantity that shows best the torque or force of its drive, if any."""
        # Quantities that show the force of a prismatic joint's drive, the best first.
        sliding = ("force", "torque", "current", "voltage")
        known = [q for q in (sliding if self.slides else TURNING) if q in self.columns]
        # A measured current shows more than a commanded torque.
        return min(known, key=lambda quantity: self.columns[quantity].commanded, default=None)

    @property
    def slides(self) -> bool:
        """Whether its angle is a length, by the unit in its name."""
        unit = self.columns["angle"].unit
        return unit is not None and UNITS[unit].dimension == "length"


def group_joints(
    meanings: Sequence[Meaning], columns: Mapping[str, NDArray], time_s: NDArray, clock: str
) -> list[JointColumns]:
    """Group columns by joint.

    Parameters
    ----------
    meanings : sequence of Meaning
        Meanings of the columns' names.
    columns : mapping of str to (n,) array
        The columns.
    time_s : (n,) array
        Times, s.
    clock : str
        Column of the clock.

    Returns
    -------
    list of JointColumns
        Joints in the order of their columns, those of a limb from the body outwards.
    """
    rows = len(time_s)
    enabled = [m for m in meanings if m.quantity == "enabled"]
    switches = [m for m in enabled if _switches(columns[m.column], rows)]
    usable = [
        m
        for m in meanings
        if m not in enabled and m.column != clock and _moves(columns[m.column], rows)
    ]
    # Counts may be of anything, so they pass for angles only where no name means an angle.
    named = any(_is_angle(m) for m in usable)
    if not named:
        usable = [_counted(m, columns[m.column]) for m in usable]
    by_joint: dict[str, list[Meaning]] = {m.joint: [] for m in usable if _is_angle(m)}
    alone = len(by_joint) == 1
    if not by_joint:
        switch = _switch(switches, "", alone=True)
        return [replace(one, enabled=switch) for one in _by_behaviour(usable, columns, time_s)]
    for meaning in usable:
        owner = _owner(meaning, by_joint)
        if owner is not None:
            by_joint[owner].append(meaning)
    joints = [
        replace(
            _joint(name, members, number, len(by_joint)), enabled=_switch(switches, name, alone)
        )
        for number, (name, members) in enumerate(by_joint.items(), 1)
    ]
    # A log whose drives are all silent shows no passive joint.
    if any(joint.drive for joint in joints):
        zeros = _zero_torques(meanings, columns, rows, by_joint)
        joints = [
            joint if joint.drive else replace(joint, zero_torque=zeros.get(name))
            for name, joint in zip(by_joint, joints, strict=True)
        ]
    # A stable sort: joints without a place in a limb keep the order of their columns.
    return sorted(joints if named else map(_with_reason_of_counts, joints), key=_place)


def moving(
    joints: Sequence[JointColumns], columns: Mapping[str, NDArray]
) -> tuple[list[JointColumns], list[str]]:
    """Return the joints that move, and the names of those that rest while others move.

    Parameters
    ----------
    joints : sequence of JointColumns
        All joints of the log.
    columns : mapping of str to (n,) array
        The columns.
    """
    # Least motion of a joint, relative to the joint that moves most: above the give of gears.
    least = 0.01
    reaches = [float(np.ptp(_known(columns[one.columns["angle"].column]))) for one in joints]
    rests = [reach < least * max(reaches) for reach in reaches]
    pairs = list(zip(joints, rests, strict=True))
    return [one for one, rest in pairs if not rest], [one.name for one, rest in pairs if rest]


def _known(values: NDArray) -> NDArray:
    return values[np.isfinite(values)].astype(float)


def _is_angle(meaning: Meaning) -> bool:
    return meaning.quantity == "angle" and not meaning.commanded


def _owner(meaning: Meaning, by_joint: Mapping[str, list[Meaning]]) -> str | None:
    """Return the joint of a column; without a name of its own it belongs to the only joint."""
    if meaning.joint in by_joint:
        return meaning.joint
    # The knee's torque is of the joint knee_flexion, if no other joint is of the knee.
    words = set(meaning.joint.split("_"))
    alike = [name for name in by_joint if words & set(name.split("_")) - {"", *SIDES}]
    if len(alike) == 1 and meaning.joint:
        return alike[0]
    if "" in by_joint:
        return ""
    return next(iter(by_joint)) if len(by_joint) == 1 else None


def _place(joint: JointColumns) -> int:
    """Return the place of a joint in its limb; 0 where its name has none."""
    # Joints of limbs, of which each carries the following ones.
    from_the_base = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    places = (place for place, name in enumerate(from_the_base, 1) if name in joint.name.lower())
    return next(places, 0)


def order_is_known(joints: Sequence[JointColumns]) -> bool:
    """Return whether the names of joints give their order: places in a limb, or numbers."""
    if len(joints) == 1 or all(re.search(r"\d+", joint.name) for joint in joints):
        return True
    places = [_place(joint) for joint in joints]
    return 0 not in places and len(set(places)) == len(places)


def may_be_one(joints: Sequence[JointColumns]) -> list[str]:
    """Return the names of joints that may be one: those of its runs, or of its statistics."""
    # The number of a run follows its word: trial_1_hip is of the hip.
    run = re.compile(rf"(?<![^_])(?:(?:{'|'.join(RUNS)})(?:_?\d+)?|{'|'.join(STATISTICS)})(?![^_])")
    by_rest: dict[str, list[str]] = {}
    for joint in joints:
        by_rest.setdefault(run.sub("", joint.name).strip("_"), []).append(joint.name)
    return [name for names in by_rest.values() if len(names) > 1 for name in names]


def _counted(meaning: Meaning, values: NDArray) -> Meaning:
    """Return a column as an angle if it may be an encoder's; counts of events never decrease."""
    # Least range of an encoder's counts; the level of a queue has a smaller one.
    many = 100.0
    known = values[np.isfinite(values)].astype(float)
    swings = are_whole(known) and np.ptp(known) > many and np.any(np.diff(known) < 0.0)
    return (in_counts(meaning) or meaning) if swings else meaning


def _with_reason_of_counts(joint: JointColumns) -> JointColumns:
    others = joint.why.get("angle")
    why = "no name contains angle, but this column is in counts" + (f", {others}" if others else "")
    return replace(joint, why={**joint.why, "angle": why}, doubtful=joint.doubtful | {"angle"})


def _switches(values: NDArray, rows: int) -> bool:
    """Return whether a column has only 0 and 1, and 1 at least once."""
    if values.dtype.kind not in "biuf" or len(values) != rows:
        return False
    known = values.astype(float)
    known = known[np.isfinite(known)]
    return bool(np.isin(known, (0.0, 1.0)).all()) and bool(known.any())


def _switch(switches: Sequence[Meaning], joint: str, alone: bool) -> str | None:
    """Return the switch of a joint: its own, else one without a joint in its name."""
    own = [m.column for m in switches if m.joint == joint]
    of_all = [m.column for m in switches if alone or not m.joint]
    return next(iter([*own, *of_all]), None)


def _moves(values: NDArray, rows: int) -> bool:
    """Return whether a column has numbers that change, other than row numbers."""
    if values.dtype.kind not in "iuf" or len(values) != rows:
        return False
    known = values[np.isfinite(values)].astype(float)
    if not len(known) or np.ptp(known) == 0.0:
        return False
    return not np.all(np.diff(known) == 1.0)


def _zero_torques(
    meanings: Sequence[Meaning],
    columns: Mapping[str, NDArray],
    rows: int,
    by_joint: Mapping[str, list[Meaning]],
) -> dict[str | None, str]:
    """Return the measured torque or current that is 0 throughout, by the key of its joint."""
    return {
        _owner(m, by_joint): m.column
        for m in meanings
        if m.quantity in TURNING and not m.commanded and _is_zero(columns[m.column], rows)
    }


def _is_zero(values: NDArray, rows: int) -> bool:
    """Return whether a column has numbers, and no other than 0."""
    if values.dtype.kind not in "iuf" or len(values) != rows:
        return False
    known = values[np.isfinite(values)]
    return bool(len(known)) and not known.any()


def _joint(key: str, members: Sequence[Meaning], number: int, joints: int) -> JointColumns:
    chosen: dict[str, Meaning] = {}
    why: dict[str, str] = {}
    doubtful = set()
    for quantity in ("angle", "velocity", "reference", "temperature", *TURNING):
        of_quantity = [m for m in members if m.quantity == quantity]
        if not of_quantity:
            continue

        def order(m: Meaning) -> tuple[bool, int]:
            return m.joint not in (key, ""), m.rank

        best, *others = sorted(of_quantity, key=order)
        chosen[quantity] = best
        reasons = []
        if best.joint not in (key, "") and key:
            reasons.append(f"its name says {best.joint}, the angle's {key}")
        if others and order(others[0]) == order(best):
            reasons.append("no name shows which")
        if reasons:
            doubtful.add(quantity)
        if others:
            reasons.append(f"rather than {', '.join(m.column for m in others)}")
        why[quantity] = ", ".join(reasons)
    # Names in a map begin with a letter, so that joint 2 becomes joint2 there.
    named = key if key and key[0].isalpha() else ""
    name = named or (f"joint{number}" if joints > 1 else "joint")
    return JointColumns(name, chosen, why, frozenset(doubtful))


def _by_behaviour(
    usable: Sequence[Meaning], columns: Mapping[str, NDArray], time_s: NDArray
) -> list[JointColumns]:
    """Return one joint of columns without meaningful names, by integrals and by a torque fit."""
    # Least share of the variance by which a velocity is recognised without a name.
    obvious = 0.9
    pairs = []
    for angle, velocity in _pairs(usable, columns, time_s):
        agreement = integral_agreement(time_s, _float(columns, angle), _float(columns, velocity))
        # For a single sine the angle integrates to the velocity, too, but with a negative slope.
        if agreement is not None and agreement.slope > 0.0:
            pairs.append((agreement.explained, angle, velocity))
    # One pair only: without names nothing shows to which of several joints a torque belongs.
    best = max(pairs, key=lambda pair: pair[0], default=None)
    if best is None or best[0] < obvious:
        return []
    share, angle, velocity = best
    rest = [m for m in usable if m not in (angle, velocity)]
    joint = _joint("", [m for m in rest if m.quantity not in ("", "velocity")], 1, 1)
    why = {
        "angle": f"no name, but {velocity.column} integrates to it ({share:.0%} of its variance)",
        "velocity": f"no name, but it integrates to {angle.column}",
    }
    joint = replace(
        joint,
        columns={**joint.columns, "angle": angle, "velocity": velocity},
        why={**joint.why, **why},
        doubtful=joint.doubtful | {"angle", "velocity"},
    )
    if joint.drive:
        return [joint]
    return [_with_torque(joint, [m for m in rest if not m.quantity], columns, time_s)]


def _pairs(
    usable: Sequence[Meaning], columns: Mapping[str, NDArray], time_s: NDArray
) -> list[tuple[Meaning, Meaning]]:
    """Return the pairs of columns that are likeliest angle and velocity."""
    angles = [m for m in usable if not (m.quantity or derived(m.column))]
    velocities = [m for m in usable if m.quantity in ("", "velocity")]
    logged = ([_float(columns, m) for m in members] for members in (angles, velocities))
    pairs = [(angles[i], velocities[j]) for i, j in likeliest_integrals(time_s, *logged)]
    return [(angle, velocity) for angle, velocity in pairs if angle is not velocity]


def _with_torque(
    joint: JointColumns,
    nameless: Sequence[Meaning],
    columns: Mapping[str, NDArray],
    time_s: NDArray,
) -> JointColumns:
    """Return a joint with the column for its torque that follows the motion best, if any does."""
    angle = _float(columns, joint.columns["angle"])
    fits = [(fit_torque(time_s, angle, _float(columns, m)), m) for m in nameless]
    shares = [(fit.explained, m) for fit, m in fits if fit is not None]
    if not shares:
        return joint
    share, torque = max(shares, key=lambda one: one[0])
    why = f"no name, but it follows the motion best ({share:.0%} of its variance)"
    return replace(
        joint,
        columns={**joint.columns, "torque": torque},
        why={**joint.why, "torque": why},
        doubtful=joint.doubtful | {"torque"},
    )


def _float(columns: Mapping[str, NDArray], meaning: Meaning) -> NDArray:
    return columns[meaning.column].astype(float)
