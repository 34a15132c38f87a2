"""What the name of a column says: its quantity, its joint, its unit, and whether it was measured."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from pipelines.settings.units import ALIASES, UNITS


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


WORDS: dict[str, frozenset[str]] = {
    quantity: _words(words)
    for quantity, words in {
        "time": "time t stamp timestamp timestamps clock zeit",
        "velocity": "vel velocity speed omega dq qd qdot dtheta thetadot rpm",
        "torque": "tau torque trq tq effort moment force load",
        "current": "cur current amp amps iq",
        "voltage": "volt volts voltage vir u",
        "temperature": "temp temperature",
        "acceleration": "acc accel acceleration ddq qdd",
        "angle": "pos position angle ang theta th q qm phi enc encoder winkel",
    }.items()
}
"""Words for each quantity."""
COMMANDED = _words("ref reference goal des desired cmd command commanded con target set setpoint sp qg soll")
FILTERED = _words("filt filtered lp smooth smoothed")
MEASURED = _words("meas measured act actual msr fb feedback ist")
ENABLED = _words("enable enabled servoon")
"""Words of a switch of the drive; ``servo_on`` and the like are two."""
SWITCHED = _words("servo drive motor torque power")
SOMETHING_ELSE = _words("cell fric friction error err count number status state mode id flag")
"""Words that make of a torque or a position something else."""
NOISE = _words("joint joints axis motor drive epos j m data value values log state states")
"""Words that tell nothing of which joint it is."""
UNIT_WORDS = {
    "rad": "rad", "deg": "deg", "rpm": "rpm", "ms": "ms", "us": "us", "ns": "ns", "nm": "N·m", "mnm": "mN·m",
    "ma": "mA", "amps": "A", "volts": "V", "mm": "mm", "rev": "rev", "counts": "counts", "sec": "s", "seconds": "s",
}  # fmt: skip
"""Units as they stand in names without brackets."""


@dataclass(frozen=True)
class Meaning:
    """What a column's name says of it."""

    column: str
    quantity: str
    """One of WORDS, ``reference``, ``enabled``, or empty where the name tells nothing."""
    joint: str
    """What is left of the name: the joint's name or number."""
    unit: str | None
    commanded: bool
    filtered: bool
    measured: bool

    @property
    def rank(self) -> int:
        """How good it is as a measurement: what was measured, what may have been, what was filtered, commanded."""
        return 3 * self.commanded + 2 * self.filtered + (not self.measured)


def meanings(names: Iterable[str]) -> list[Meaning]:
    """Return what each name says."""
    return [meaning(name) for name in names]


def meaning(name: str) -> Meaning:
    """Return what a name says."""
    plain, unit = _unit(name)
    words = [word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", plain)]
    unit = (
        unit
        or ("deg" if "°" in plain else None)
        or next((UNIT_WORDS[word] for word in reversed(words) if word in UNIT_WORDS), None)
    )
    commanded = any(word in COMMANDED for word in words)
    quantity = next((quantity for quantity, known in WORDS.items() if known & set(words)), "")
    if set(words) & SOMETHING_ELSE:
        quantity = ""
    elif set(words) & ENABLED or ("on" in words and set(words) & SWITCHED):
        quantity, words = "enabled", [word for word in words if word not in ENABLED | SWITCHED | {"on"}]
    elif commanded and quantity in ("angle", ""):
        quantity = "reference"
    known = set().union(*WORDS.values()) | COMMANDED | FILTERED | MEASURED | NOISE | set(UNIT_WORDS) | {"s"}
    joint = "_".join(word for word in words if word not in known)
    return Meaning(
        name, quantity, joint, unit, commanded, bool(set(words) & FILTERED), bool(set(words) & MEASURED)
    )  # fmt: skip


def _unit(name: str) -> tuple[str, str | None]:
    """Return a name without the unit in brackets at its end, and that unit where it is one."""
    found = re.fullmatch(r"(.*?)\s*[\[(]\s*([^\])]*)\s*[\])]\s*", name)
    if found is None or found[2].isdigit():
        return name, None
    unit = ALIASES.get(found[2].strip(), found[2].strip())
    return found[1], unit if unit in UNITS else None
