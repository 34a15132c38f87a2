"""Which columns belong to one joint, and which of them is its angle, its velocity, its torque."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.consistency import integral_agreement
from pipelines.importing.guess.names import Meaning
from pipelines.importing.guess.torque import fit_torque

DRIVES = ("torque", "current", "voltage")
"""What may tell of the torque, the best first."""
OBVIOUS = 0.9
"""Share of the variance by which a velocity is known whatever its name."""


@dataclass(frozen=True)
class JointColumns:
    """The columns of one joint by quantity; what the log lacks is not there."""

    name: str
    columns: Mapping[str, Meaning]
    why: Mapping[str, str]
    """Of what was not found by its name alone."""


def group_joints(
    meanings: Sequence[Meaning], columns: Mapping[str, NDArray], time_s: NDArray, clock: str
) -> list[JointColumns]:
    """Return the joints of a log of columns (n,) at times (n,) s, in the order of their columns."""
    usable = [m for m in meanings if m.column != clock and _moves(columns[m.column], len(time_s))]
    by_joint: dict[str, list[Meaning]] = {}
    for found in usable:
        if found.quantity == "angle" and not found.commanded:
            by_joint.setdefault(found.joint, [])
    if not by_joint:
        return _by_behaviour(usable, columns, time_s)
    for found in usable:
        owner = found.joint if found.joint in by_joint else "" if "" in by_joint else None
        if owner is None and len(by_joint) == 1:
            owner = next(iter(by_joint))
        if owner is not None:
            by_joint[owner].append(found)
    return [_joint(name, members, number, len(by_joint)) for number, (name, members) in enumerate(by_joint.items(), 1)]


def _moves(values: NDArray, rows: int) -> bool:
    return values.dtype.kind in "iuf" and len(values) == rows and bool(np.nanstd(values.astype(float)) > 0.0)


def _joint(key: str, members: Sequence[Meaning], number: int, joints: int) -> JointColumns:
    chosen: dict[str, Meaning] = {}
    why: dict[str, str] = {}
    for quantity in ("angle", "velocity", "reference", "temperature", *DRIVES):
        candidates = sorted((m for m in members if m.quantity == quantity), key=lambda m: m.rank)
        if not candidates:
            continue
        chosen[quantity] = candidates[0]
        others = [m.column for m in candidates[1:]]
        if others:
            why[quantity] = f"rather than {', '.join(others)}"
    named = key if key and key[0].isalpha() else ""
    return JointColumns(named or (f"joint{number}" if joints > 1 else "joint"), chosen, why)


def _by_behaviour(usable: Sequence[Meaning], columns: Mapping[str, NDArray], time_s: NDArray) -> list[JointColumns]:
    """Return one joint of columns whose names tell nothing: what integrates to what, what follows the motion."""
    # Of a single sine the angle integrates to the velocity too, but with the other sign.
    pairs = [
        (agreement.explained, angle, velocity)
        for angle in usable
        for velocity in usable
        if angle is not velocity
        and (agreement := integral_agreement(time_s, _float(columns, angle), _float(columns, velocity))) is not None
        and agreement.slope > 0.0
    ]
    best = max(pairs, key=lambda pair: pair[0], default=None)
    if best is None or best[0] < OBVIOUS:
        return []
    share, angle, velocity = best
    found = {"angle": angle, "velocity": velocity}
    why = {
        "angle": f"no name says so, but {velocity.column} integrates to it ({share:.0%} of its variance)",
        "velocity": f"no name says so, but it integrates to {angle.column}",
    }
    fits = [
        (fit.explained, m)
        for m in usable
        if m not in (angle, velocity)
        and (fit := fit_torque(time_s, _float(columns, angle), _float(columns, m))) is not None
    ]
    if fits:
        share, torque = max(fits, key=lambda one: one[0])
        found["torque"] = torque
        why["torque"] = f"no name says so, but it follows the motion best ({share:.0%} of its variance)"
    return [JointColumns("joint", found, why)]


def _float(columns: Mapping[str, NDArray], meaning: Meaning) -> NDArray:
    return columns[meaning.column].astype(float)
