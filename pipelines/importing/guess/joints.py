"""Which columns belong to one joint, and which of them is its angle, its velocity, its torque."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.guess.names import TWIN, Meaning, in_counts
from pipelines.importing.guess.register import are_whole
from pipelines.importing.guess.torque import fit_torque
from pipelines.importing.quantities.consistency import integral_agreement, likeliest_integrals
from pipelines.settings.units import UNITS

TURNING, SLIDING = (
    ("torque", "current", "force", "voltage"),
    ("force", "torque", "current", "voltage"),
)
"""What may tell what the drive of a joint delivers, the best first."""
OBVIOUS = 0.9
"""Share of the variance by which a velocity is known whatever its name."""
FEW_PAIRS = 400
"""So many pairs of columns are looked at one by one: twenty columns, each with each."""
MANY = 100.0
"""So many counts a column goes over that is an encoder's, and no queue's."""
FROM_THE_BASE = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
"""Joints of limbs, of which each carries those behind it."""


@dataclass(frozen=True)
class JointColumns:
    """The columns of one joint by quantity; what the log lacks is not there."""

    name: str
    columns: Mapping[str, Meaning]
    why: Mapping[str, str]
    """Of what was not found by its name alone."""
    enabled: str | None = None
    """Column of 0 and 1 that says whether its drive is on."""

    @property
    def drive(self) -> str | None:
        """The quantity that tells best what its drive delivers; None where none does."""
        return next(
            (
                quantity
                for quantity in (SLIDING if self.slides else TURNING)
                if quantity in self.columns
            ),
            None,
        )

    @property
    def slides(self) -> bool:
        """Whether the name of its angle says that it is a length."""
        unit = self.columns["angle"].unit
        return unit is not None and UNITS[unit].dimension == "length"


def group_joints(
    meanings: Sequence[Meaning], columns: Mapping[str, NDArray], time_s: NDArray, clock: str
) -> list[JointColumns]:
    """Return the joints of a log of columns (n,) at times (n,) s, in their columns' order, a limb's
    from the body."""
    usable = [
        m
        for m in meanings
        if m.column != clock and m.quantity != "enabled" and _moves(columns[m.column], len(time_s))
    ]
    switches = [
        m for m in meanings if m.quantity == "enabled" and _switches(columns[m.column], len(time_s))
    ]
    told = any(found.quantity == "angle" and not found.commanded for found in usable)
    if not told:
        usable = [_counted(found, columns[found.column]) for found in usable]
    by_joint: dict[str, list[Meaning]] = {}
    for found in usable:
        if found.quantity == "angle" and not found.commanded:
            by_joint.setdefault(found.joint, [])
    if not by_joint:
        return [
            replace(one, enabled=_switch(switches, "", alone=True))
            for one in _by_behaviour(usable, columns, time_s)
        ]
    for found in usable:
        owner = found.joint if found.joint in by_joint else "" if "" in by_joint else None
        if owner is None and len(by_joint) == 1:
            owner = next(iter(by_joint))
        if owner is not None:
            by_joint[owner].append(found)
    joints = [
        replace(
            _joint(name, members, number, len(by_joint)),
            enabled=_switch(switches, name, len(by_joint) == 1),
        )
        for number, (name, members) in enumerate(by_joint.items(), 1)
    ]
    return sorted(joints if told else map(_told_by_counts, joints), key=_place)


def _place(joint: JointColumns) -> int:
    """Return where a joint stands in its limb; nought where its name does not say."""
    return next(
        (place for place, name in enumerate(FROM_THE_BASE, 1) if name in joint.name.lower()), 0
    )


def order_is_told(joints: Sequence[JointColumns]) -> bool:
    """Tell whether the names of joints say which carries which: places in a limb, or numbers."""
    places = [_place(joint) for joint in joints]
    numbered = [re.search(r"\d+", joint.name) for joint in joints]
    return (
        len(joints) == 1 or (0 not in places and len(set(places)) == len(places)) or all(numbered)
    )


def _counted(found: Meaning, values: NDArray) -> Meaning:
    """Return a column as an angle where that is what it may count; what never goes back counts
    events, or time."""
    known = values[np.isfinite(values)].astype(float)
    swings = are_whole(known) and np.ptp(known) > MANY and np.any(np.diff(known) < 0.0)
    return (in_counts(found) or found) if swings else found


def _told_by_counts(joint: JointColumns) -> JointColumns:
    rather = joint.why.get("angle")
    why = "no name says angle, but this one is in counts" + (f", {rather}" if rather else "")
    return replace(joint, why={**joint.why, "angle": why})


def _switches(values: NDArray, rows: int) -> bool:
    """Tell whether a column holds 0 and 1 alone, and not 0 alone: then it would say that the drive
    never was on."""
    if values.dtype.kind not in "biuf" or len(values) != rows:
        return False
    known = values.astype(float)
    known = known[np.isfinite(known)]
    return bool(np.isin(known, (0.0, 1.0)).all()) and bool(known.any())


def _switch(switches: Sequence[Meaning], joint: str, alone: bool) -> str | None:
    """Return the switch of a joint: its own, else that of all, which names none."""
    own = [m.column for m in switches if m.joint == joint]
    of_all = [m.column for m in switches if alone or not m.joint]
    return next(iter([*own, *of_all]), None)


def _moves(values: NDArray, rows: int) -> bool:
    """Tell whether a column holds numbers that change, but do not merely count the rows."""
    if values.dtype.kind not in "iuf" or len(values) != rows:
        return False
    known = values[np.isfinite(values)].astype(float)
    return (
        bool(len(known)) and bool(np.ptp(known) > 0.0) and not bool(np.all(np.diff(known) == 1.0))
    )


def _joint(key: str, members: Sequence[Meaning], number: int, joints: int) -> JointColumns:
    chosen: dict[str, Meaning] = {}
    why: dict[str, str] = {}
    for quantity in ("angle", "velocity", "reference", "temperature", *TURNING):
        candidates = sorted((m for m in members if m.quantity == quantity), key=lambda m: m.rank)
        if not candidates:
            continue
        chosen[quantity] = candidates[0]
        others = [m.column for m in candidates[1:]]
        if others:
            twin = TWIN.sub("", others[0]) == TWIN.sub("", candidates[0].column)
            why[quantity] = (
                f"{'no name says which, ' if twin else ''}rather than {', '.join(others)}"
            )
    named = key if key and key[0].isalpha() else ""
    return JointColumns(named or (f"joint{number}" if joints > 1 else "joint"), chosen, why)


def _by_behaviour(
    usable: Sequence[Meaning], columns: Mapping[str, NDArray], time_s: NDArray
) -> list[JointColumns]:
    """Return one joint of columns whose names tell nothing: what integrates to what, what follows
    the motion."""
    # Of a single sine the angle integrates to the velocity too, but with the other sign.
    pairs = [
        (agreement.explained, angle, velocity)
        for angle, velocity in _pairs(usable, columns, time_s)
        if (
            agreement := integral_agreement(
                time_s, _float(columns, angle), _float(columns, velocity)
            )
        )
        is not None
        and agreement.slope > 0.0
    ]
    best = max(pairs, key=lambda pair: pair[0], default=None)
    if best is None or best[0] < OBVIOUS:
        return []
    share, angle, velocity = best
    rest = [m for m in usable if m not in (angle, velocity)]
    found = _joint("", [m for m in rest if m.quantity not in ("", "velocity")], 1, 1)
    why = {
        "angle": (
            f"no name says so, but {velocity.column} integrates to it ({share:.0%} of its variance)"
        ),
        "velocity": f"no name says so, but it integrates to {angle.column}",
    }
    joint = replace(
        found,
        columns={**found.columns, "angle": angle, "velocity": velocity},
        why={**found.why, **why},
    )
    return [
        (
            joint
            if joint.drive
            else _with_a_torque(joint, [m for m in rest if not m.quantity], columns, time_s)
        )
    ]


def _pairs(
    usable: Sequence[Meaning], columns: Mapping[str, NDArray], time_s: NDArray
) -> list[tuple[Meaning, Meaning]]:
    """Return every pair of columns that may be angle and velocity; of many columns the likeliest
    pairs."""
    angles = [m for m in usable if not m.quantity]
    velocities = [m for m in usable if m.quantity in ("", "velocity")]
    if len(angles) * len(velocities) <= FEW_PAIRS:
        found = [(angle, velocity) for angle in angles for velocity in velocities]
    else:
        logged = ([_float(columns, m) for m in members] for members in (angles, velocities))
        found = [(angles[i], velocities[j]) for i, j in likeliest_integrals(time_s, *logged)]
    return [(angle, velocity) for angle, velocity in found if angle is not velocity]


def _with_a_torque(
    joint: JointColumns,
    nameless: Sequence[Meaning],
    columns: Mapping[str, NDArray],
    time_s: NDArray,
) -> JointColumns:
    """Return a joint with the column for its torque that follows the motion best, where one does at
    all."""
    angle = _float(columns, joint.columns["angle"])
    fits = [
        (fit.explained, m)
        for m in nameless
        if (fit := fit_torque(time_s, angle, _float(columns, m))) is not None
    ]
    if not fits:
        return joint
    share, torque = max(fits, key=lambda one: one[0])
    why = f"no name says so, but it follows the motion best ({share:.0%} of its variance)"
    return replace(
        joint, columns={**joint.columns, "torque": torque}, why={**joint.why, "torque": why}
    )


def _float(columns: Mapping[str, NDArray], meaning: Meaning) -> NDArray:
    return columns[meaning.column].astype(float)
