"""Report implausible values in an imported recording, without correcting them."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.contracts.joints import in_words
from pipelines.errors import InputError
from pipelines.importing.finding import Finding, counted
from pipelines.importing.quantities.consistency import MOST, integral_agreement, whole_rows
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import known_in_words, machine_of, mechanisms_of
from pipelines.mechanics.remedies import AT_REST
from pipelines.settings.import_map import ImportMap, JointSettings
from pipelines.signals.cut_off import cut_off_at
from pipelines.signals.filler import fill_value
from pipelines.signals.folded import is_folded, is_folded_angle
from pipelines.signals.held import new_values
from pipelines.signals.leaping import leaps
from pipelines.signals.power import absorbed_w
from pipelines.signals.rescaled import is_rescaled

STRONGEST = {"torque": 1e3, "force": 1e5}
"""N·m and N; drives of legs, arms and robots deliver less, so more is mostly in another unit."""
SHORTEST = {"revolute": (1e-3, "rad"), "prismatic": (1e-5, "m")}
"""Least motion of a joint from which inertia can be seen, about the play of a gear or screw."""


def limited(settings: ImportMap) -> list[bool]:
    """Return for each joint whether its angle has a limit.

    A slide has no angle. A revolute joint may turn on if the map says so, or if no torque depends
    on its angle, as about a vertical axis.
    """
    geometry = Geometry(**settings.geometry.model_dump(exclude_none=True))
    joints = [joint.joint for joint in settings.joint]
    try:
        machine = machine_of(joints, geometry)
    except InputError:
        # A machine that exoid does not know may have gravity at every joint.
        bends = [True] * len(joints)
    else:
        bends = [machine.place(joint.name) in machine.mechanism.bends_at for joint in joints]
    return [
        joint.kind == "revolute" and not joint.turns and depends
        for joint, depends in zip(joints, bends, strict=True)
    ]


def check(columns: Mapping[str, NDArray], settings: ImportMap) -> Iterator[Finding]:
    """Report implausible values.

    Parameters
    ----------
    columns : mapping of str to (n,) array
        The recording's columns, SI.
    settings : ImportMap
        The map, with its joints and geometry.

    Yields
    ------
    Finding
        One for each implausible value.
    """
    for joint in settings.joint:
        yield from _still(columns, joint, is_only_joint=len(settings.joint) == 1)
        yield from _velocity(columns, joint)
        yield from _too_short(columns, joint)
        yield from _turns_on(columns, joint)
        yield from _slips(columns, joint)
        yield from _leaps(columns, joint)
        yield from _without_sign(columns, joint)
        yield from _too_strong(columns, joint)
        for quantity in _torque_of(joint):
            name = joint.joint.column(quantity)
            yield from _misread_torque(name, columns[name])
    yield from _copies(columns, settings.joint)
    joints = [joint.joint for joint in settings.joint]
    # Drives whose torque was not measured may do the work that the others absorb.
    if all(joint.is_measured for joint in joints):
        yield from _power(columns, settings.joint)
    known = mechanisms_of(joints)
    has_length = any(mechanism.has_length for mechanism in known)
    if has_length and settings.geometry.thigh_length_m is None:
        yield Finding(
            "geometry",
            "no thigh_length_m, from the first joint's axis to the second's",
            "later stages take that of exoid.toml, or of the paper's leg",
        )
    if not known:
        yield Finding(
            "joints",
            f"{in_words(joints)} make no known mechanism, which are: {known_in_words()}",
            "kept; exoid filter accepts them, exoid identify and exoid diagnose do not",
        )


def _still(
    columns: Mapping[str, NDArray], joint: JointSettings, *, is_only_joint: bool
) -> Iterator[Finding]:
    # A joint may rest if its torque was not measured: its angle matters to the other joints.
    angle = ("angle",) if joint.joint.is_measured else ()
    for quantity in (*angle, *_torque_of(joint)):
        name = joint.joint.column(quantity)
        if np.ptp(columns[name]) == 0.0:
            action = "it carries no information"
            if quantity == "angle" and not is_only_joint:
                # Another log, or another import, may have runs in which it moves.
                action += f"; validate on a run in which it moves, or {AT_REST}"
            if quantity == "torque" and not columns[name].any():
                action += '; set drive = "none" in place of the table if the joint has no drive'
            yield Finding(name, f"is {columns[name][0]:.6g} in every row", action)


def _torque_of(joint: JointSettings) -> tuple[str, ...]:
    """Return the quantity torque, if the log has it."""
    return ("torque",) if joint.joint.has_sensor else ()


def _too_short(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    name, (least, unit) = joint.joint.column("angle"), SHORTEST[joint.kind]
    reach = float(np.ptp(columns[name]))
    if 0.0 < reach < least and joint.joint.is_measured:
        seen = (
            f"moves over {reach:.3g} {unit} only, expected {least:g} {unit} or more to see inertia"
        )
        yield Finding(name, seen, "kept; check its unit, scale and gear_ratio")


def _turns_on(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    """Report a joint that turns further than joints do, although the map does not say so."""
    name = joint.joint.column("angle")
    reach = float(np.max(np.abs(columns[name])))
    if joint.kind == "revolute" and not joint.turns and reach > LARGEST_ANGLE_RAD:
        seen = f"moves over {np.ptp(columns[name]) / (2.0 * np.pi):.3g} turns"
        yield Finding(
            name, seen, "kept, as no torque depends on it; set turns = true, or correct its unit"
        )


def _slips(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    """Report single readings far from nearly all others."""
    # Distance from the median, relative to that of 99 % of the rows, that marks an outlier.
    far_off = 20.0
    for quantity in ("angle", *_torque_of(joint)):
        name = joint.joint.column(quantity)
        filler = fill_value(columns[name])
        if filler is not None:
            count = counted(int(np.count_nonzero(columns[name] == filler)), "row")
            seen = f"is exactly {filler:.6g} in {count}, far from all others"
            yield Finding(name, seen, "kept; if it marks missing readings, set a range")
            continue
        # Median and quantile: an outlier must not widen the range that it is judged by.
        some = _every_kth(columns[name])
        middle = float(np.median(some))
        usual = float(np.quantile(np.abs(some - middle), 0.99))
        least, most = middle - far_off * usual, middle + far_off * usual
        far = np.flatnonzero((columns[name] < least) | (columns[name] > most))
        if usual > 0.0 and len(far):
            seen = (
                f"{counted(len(far), 'row')} far off, the first {columns[name][far[0]]:.4g} at"
                f" {columns['time_s'][far[0]]:.6g} s; 99 % lie between {middle - usual:.4g} and"
                f" {middle + usual:.4g}"
            )
            yield Finding(name, seen, "kept; to exclude an outlier, set a range at the reading")


def _leaps(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    """Report an angle that leaps, as where records are put together."""
    name = joint.joint.column("angle")
    rows = leaps(columns["time_s"], columns[name])
    if len(rows):
        before, after = columns[name][rows[0] - 1 : rows[0] + 1]
        times = "once" if len(rows) == 1 else f"{len(rows)} times"
        seen = (
            f"leaps {times}, first from {before:.4g} to {after:.4g} at"
            f" {columns['time_s'][rows[0]]:.6g} s, as no mass can"
        )
        action = (
            "kept; rows there may be of two records, in another order, or repeat an old value:"
            " divide the log there with span_s"
        )
        yield Finding(name, seen, action)


def _without_sign(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    """Report an angle that turns round at 0, as an inclinometer's magnitude."""
    name = joint.joint.column("angle")
    values = columns[name][new_values(columns[name])]
    if joint.kind == "revolute" and is_folded_angle(values):
        seen = "turns round at 0 as a magnitude does, so its sign is missing"
        action = (
            "kept; where another column has it, let an expression multiply both. If the joint"
            " rebounds from a stop there, it is right"
        )
        yield Finding(name, seen, action)


def _every_kth(values: NDArray) -> NDArray:
    """Return every k-th of the values (n,), still enough for a quantile."""
    return values[:: max(1, len(values) // MOST)]


def _too_strong(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    quantity, unit = ("torque", "N·m") if joint.kind == "revolute" else ("force", "N")
    if not joint.joint.has_sensor:
        return
    name = joint.joint.column("torque")
    reach = float(np.quantile(np.abs(_every_kth(columns[name])), 0.99))
    if reach > STRONGEST[quantity]:
        seen = (
            f"reaches {reach:.4g} {unit}, expected at most about {STRONGEST[quantity]:g} {unit} of"
            " a drive"
        )
        yield Finding(
            name,
            seen,
            f"kept; check its unit (is it m{unit}?), scale, gear_ratio and torque constant",
        )


def _copies(columns: Mapping[str, NDArray], joints: Sequence[JointSettings]) -> Iterator[Finding]:
    """Report joints whose angles are those of another, as of several samples in a row."""
    # Share of a motion by which the angles of two joints differ at least, as an rms value.
    least = 0.005
    names = [joint.joint.column("angle") for joint in joints]
    for one, other in combinations(names, 2):
        values, copy = (columns[name] - np.mean(columns[name]) for name in (one, other))
        motion, moves = float(values @ values), np.diff(values)
        if motion == 0.0:
            continue
        # Another sample of a row is later by a share of the time to the next row.
        apart = (copy - values)[:-1]
        share = float(apart @ moves) / float(moves @ moves)
        rest = apart - share * moves
        if abs(share) < 1.0 and float(rest @ rest) < least**2 * motion:
            seen = f"is {one}, {abs(share):.1f} of a row apart"
            action = "kept; if both are one joint's, give each sample a row, and leave one out"
            yield Finding(other, seen, action)


def _misread_torque(name: str, values: NDArray) -> Iterator[Finding]:
    """Report a torque (n,) with another factor now and then, without its sign, or cut off."""
    new = values[new_values(values)]
    if is_rescaled(new):
        seen = "leaps by a factor of ten, and back, as a display whose decimal point moves"
        yield Finding(name, seen, "kept; log it with one decimal point")
    if is_folded(new):
        seen = "turns round at 0 as a magnitude does, so its sign is missing or wrong"
        action = "kept; where another column has it, let an expression multiply both"
        yield Finding(name, seen, action)
    if ends := cut_off_at(values):
        limits = " and ".join(f"{end:.4g}" for end in ends)
        seen = f"comes to {limits} at full slope and stays there, so larger values are cut off"
        action = "kept; log a larger range. If the drive limits its torque there, it is right"
        yield Finding(name, seen, action)


def _velocity(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    # Share of the variance that velocity and angle must share before their slope is judged.
    least_explained = 0.5
    # Largest deviation of that slope from 1, for a filter in the drive or a late sample.
    slope_tolerance = 0.15
    name, angle = joint.joint.column("velocity"), joint.joint.column("angle")
    if name not in columns:
        return
    agreement = integral_agreement(columns["time_s"], columns[angle], columns[name])
    if agreement is None or agreement.explained <= least_explained:
        return
    if abs(agreement.slope - 1.0) > slope_tolerance:
        seen = f"integrates to {agreement.slope:.3g} times the change of {angle}"
        yield Finding(
            name, seen, "kept; check unit, sign and gear_ratio of both, and the unit of time"
        )


def _power(columns: Mapping[str, NDArray], joints: Sequence[JointSettings]) -> Iterator[Finding]:
    """Report drives that brake on average; a single one may, where another one moves it."""
    names = [("time_s", *map(joint.joint.column, ("angle", "torque"))) for joint in joints]
    absorbed = absorbed_w(whole_rows(*(columns[name] for name in own)) for own in names)
    if absorbed is not None:
        seen = f"the drives absorb {absorbed:.3g} W on average, but friction must consume power"
        yield Finding("torque", seen, "kept; check the signs of angles and torques")
