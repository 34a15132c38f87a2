"""What an imported recording says of itself that cannot be right: told, never mended."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import in_words
from pipelines.importing.finding import Finding, counted
from pipelines.importing.quantities.consistency import MOST, integral_agreement, mean_power
from pipelines.mechanics.machine import known_in_words, mechanisms_of
from pipelines.settings.import_map import ImportMap, JointSettings

ALIKE = 0.5
"""Share of the variance that velocity and angle must have in common before their slope is
judged."""
OFF = 0.15
"""By so much the slope between both may be off 1: a filter in the drive, a late sample."""
STRONGEST = {"torque": 1e3, "force": 1e5}
"""N·m and N: the drives of legs, arms and robots deliver less at a joint; what is more is mostly in
another unit."""
SHORTEST = {"revolute": (1e-3, "rad"), "prismatic": (1e-5, "m")}
"""Play and bending of a gear or a screw are as much: of a joint that moves less nothing is
learnt."""
FAR = 20.0
"""Times further off the middle than 99 % of a column's rows: no motion or load of a machine does
that once."""
GIVES_BACK = 0.2
"""Share of the mean magnitude of power that a drive may take out of a motion, on the whole."""


def look_at(columns: Mapping[str, NDArray], settings: ImportMap) -> Iterator[Finding]:
    """Yield what is not plausible about a recording's columns, (n,) each in SI units."""
    for joint in settings.joint:
        yield from _still(columns, joint)
        yield from _velocity(columns, joint)
        yield from _too_short(columns, joint)
        yield from _slips(columns, joint)
        yield from _too_strong(columns, joint)
    yield from _power(columns, settings.joint)
    joints = [joint.joint for joint in settings.joint]
    known = mechanisms_of(joints)
    if (
        any(mechanism.has_length for mechanism in known)
        and settings.geometry.thigh_length_m is None
    ):
        why = "later stages take that of exoid.toml, or of the paper's leg"
        yield Finding(
            "geometry", "no thigh_length_m, from the first joint's axis to the second's", why
        )
    if not known:
        seen = (
            f"{in_words(joints)}, and of the mechanisms that exoid knows none has these:"
            f" {known_in_words()}"
        )
        yield Finding(
            "joints",
            seen,
            "kept; exoid filter takes them, exoid identify and exoid diagnose do not",
        )


def _still(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    for quantity in ("angle", "torque"):
        name = joint.joint.column(quantity)
        if np.ptp(columns[name]) == 0.0:
            yield Finding(
                name, f"is {columns[name][0]:.6g} in every row", "nothing can be learnt from it"
            )


def _too_short(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    name, (least, unit) = joint.joint.column("angle"), SHORTEST[joint.kind]
    way = float(np.ptp(columns[name]))
    if 0.0 < way < least:
        seen = (
            f"moves over {way:.3g} {unit} only, and what a joint does within {least:g} {unit} shows"
            " no mass"
        )
        yield Finding(name, seen, "kept; check its unit, scale and gear_ratio")


def _slips(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    """Tell of single readings far beyond what nearly all others are."""
    for quantity in ("angle", "torque"):
        name = joint.joint.column(quantity)
        some = _thinned(columns[name])
        middle = float(np.median(some))
        usual = float(np.quantile(np.abs(some - middle), 0.99))
        least, most = middle - FAR * usual, middle + FAR * usual
        far = np.flatnonzero((columns[name] < least) | (columns[name] > most))
        if usual > 0.0 and len(far):
            seen = (
                f"{counted(len(far), 'row')} far off, the first {columns[name][far[0]]:.4g} at"
                f" {columns['time_s'][far[0]]:.6g} s; 99 % lie between {middle - usual:.4g} and"
                f" {middle + usual:.4g}"
            )
            yield Finding(name, seen, "kept; if it is a slip, a range at the reading leaves it out")


def _thinned(values: NDArray) -> NDArray:
    """Return every k-th of the values (n,), enough of them for a quantile."""
    return values[:: max(1, len(values) // MOST)]


def _too_strong(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    quantity, unit = ("torque", "N·m") if joint.kind == "revolute" else ("force", "N")
    name = joint.joint.column("torque")
    reach = float(np.quantile(np.abs(_thinned(columns[name])), 0.99))
    if reach > STRONGEST[quantity]:
        seen = (
            f"reaches {reach:.4g} {unit}, and drives of legs, arms and robots at most some"
            f" {STRONGEST[quantity]:g}"
        )
        yield Finding(
            name,
            seen,
            f"kept; check its unit (is it m{unit}?), scale, gear_ratio and torque constant",
        )


def _velocity(columns: Mapping[str, NDArray], joint: JointSettings) -> Iterator[Finding]:
    name, angle = joint.joint.column("velocity"), joint.joint.column("angle")
    found = (
        integral_agreement(columns["time_s"], columns[angle], columns[name])
        if name in columns
        else None
    )
    if found is not None and found.explained > ALIKE and abs(found.slope - 1.0) > OFF:
        seen = f"integrates to {found.slope:.3g} times the way that {angle} goes"
        yield Finding(
            name, seen, "kept; check unit, sign and gear_ratio of both, and the unit of time"
        )


def _power(columns: Mapping[str, NDArray], joints: Sequence[JointSettings]) -> Iterator[Finding]:
    """Tell of drives that together brake: one alone may, where another moves what it carries."""
    powers = [
        mean_power(
            columns["time_s"],
            columns[joint.joint.column("angle")],
            columns[joint.joint.column("torque")],
        )
        for joint in joints
    ]
    mean, size = (sum(values) for values in zip(*powers, strict=True))
    if mean < -GIVES_BACK * size:
        seen = (
            f"the drives take {-mean:.3g} W out of the motion on the whole, as friction leaves them"
            " nothing to take"
        )
        yield Finding("torque", seen, "kept; check the signs of angles and torques")
