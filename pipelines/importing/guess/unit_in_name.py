"""The unit that a column's name tells: in brackets, ``I_q (mA)``, after a slash, ``I/mA``, or as a
word, ``I_mA``."""

import re
from dataclasses import dataclass

from pipelines.settings.units import ALIASES, UNITS

QUANTITIES = {
    "time": "time",
    "angle": "angle",
    "length": "angle",
    "counts": "angle",
    "counts per second": "velocity",
    "angular velocity": "velocity",
    "velocity": "velocity",
    "torque": "torque",
    "force": "force",
    "current": "current",
    "voltage": "voltage",
    "temperature": "temperature",
}
"""What is measured in a unit of each dimension; a share may be of anything."""
OTHERS = (
    *(
        f"{angle}/s{square}"
        for angle in ("rad", "deg", "°", "m", "mm", "rev")
        for square in ("²", "2", "^2")
    ),
    *(
        "Nm/s",
        "Nm/rad",
        "Nm/deg",
        "Nm/A",
        "Nms",
        "A/s",
        "V/s",
        "W",
        "kW",
        "Hz",
        "kHz",
        "J",
        "bar",
        "Pa",
        "kg",
        "Ohm",
    ),
)
"""Units of what no map asks for."""
BRACKETS = re.compile(r"[\[({<]([^\])}>]*)[\])}>]")


@dataclass(frozen=True)
class UnitInName:
    """A unit that a name tells, and what is left of the name without it."""

    rest: str
    unit: str | None
    """None where what stands there is a unit of something else."""
    decides: bool
    """Whether it says by itself what the column is; a letter or a word may mean something else, and
    only confirms."""

    @property
    def quantity(self) -> str:
        """What is measured in it; empty where it does not say."""
        return QUANTITIES.get(UNITS[self.unit].dimension, "") if self.unit else ""


def unit_in(name: str) -> UnitInName | None:
    """Return the unit in a name; None where it tells none."""
    for bracket in BRACKETS.finditer(name):
        text = bracket[1].strip()
        if text in OTHERS or (unit := _written(text)):
            rest = f"{name[: bracket.start()]} {name[bracket.end() :]}"
            return UnitInName(rest, None if text in OTHERS else unit, decides=True)
    found = list(_WORD.finditer(name)) or list(_LETTER.finditer(name))
    if not found:
        return None
    unit = _written(found[-1][0])
    rest = f"{name[: found[-1].start()]} {name[found[-1].end() :]}"
    return UnitInName(
        rest, unit, found[-1].re is _WORD and (unit is None or _is_plain(found[-1][0], unit))
    )


def _is_plain(text: str, unit: str) -> bool:
    """Tell whether a word without brackets can hardly be anything but that unit: ticks are of
    clocks, ms of speed."""
    return UNITS[unit].dimension not in ("time", "counts") and text.lower() not in (
        "rev",
        "turn",
        "turns",
    )


def _written(text: str) -> str | None:
    """Return the unit that is written so, in letters of either case but for a single one."""
    return _FORMS.get(text) or (_FOLDED.get(text.casefold()) if len(text) > 1 else None)


def _forms() -> dict[str, str]:
    """Return how each unit may be written, ``rad_s`` and ``deg_per_s`` among them."""
    forms = {name: name for name in UNITS if name != "iso8601"} | ALIASES
    for name, unit in list(forms.items()):
        forms |= {name.replace("/", per): unit for per in ("_", "_per_", " per ") if "/" in name}
        forms |= {
            name.replace("·", times): unit for times in ("_", "*", ".", "-", " ", "") if "·" in name
        }
    return forms


_FORMS = _forms()
_FOLDED = {text.casefold(): unit for text, unit in _FORMS.items() if len(text) > 1}
_ALONE = [
    text
    for text in [*_FORMS, *OTHERS, *(text.replace("/", "_") for text in OTHERS)]
    if len(text) > 1
]
# `in` and `min` are words, and a minimum; in brackets they are units.
_ANY = "|".join(
    re.escape(text) for text in sorted(_ALONE, key=len, reverse=True) if text not in ("in", "min")
)
_BEFORE, _AFTER = r"(?:(?<![^\W_])|(?<=[a-z0-9])(?=[A-Z]))", r"(?:(?![^\W\d_])|(?=[A-Z][a-z]))"
_WORD = re.compile(rf"{_BEFORE}(?i:{_ANY}){_AFTER}")
_LETTER = re.compile(r"(?<=[^\W_][_\s./,:-])[smAVNKC°%]$")
