"""The unit in a column's name: in brackets, ``I_q (mA)``, after a slash, or as a word, ``I_mA``."""

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
"""Quantity that is measured in each dimension; a share may be of anything."""
OTHERS = (
    *(
        f"{angle}/s{square}"
        for angle in ("rad", "deg", "°", "m", "mm", "rev")
        for square in ("²", "2", "^2")
    ),
    *("Nm/s", "Nm/rad", "Nm/deg", "Nm/A", "Nms", "A/s", "V/s"),
    *("W", "kW", "Hz", "kHz", "J", "bar", "Pa", "kg", "Ohm"),
)
"""Units of quantities that no map has."""
FOREIGN = {
    **dict.fromkeys(("gon", "grad", "mgon", "arcmin", "arcsec", "ft"), "angle"),
    **dict.fromkeys(("gon/s", "grad/s", "deg/min", "°/min", "rad/min", "rev/h"), "velocity"),
    **dict.fromkeys(("m/min", "mm/min", "in/min", "ft/s", "km/h", "mph"), "velocity"),
    **dict.fromkeys(
        ("kgf·m", "kgf*m", "kgf.m", "kgfm", "kpm", "kp·m", "dyn·cm", "gf·cm"), "torque"
    ),
    **dict.fromkeys(("oz-in", "ozf-in", "oz·in", "ozf·in", "ozin", "dNm", "daNm"), "torque"),
    **dict.fromkeys(("gf", "daN", "ozf", "dyn"), "force"),
    **dict.fromkeys(("µA", "μA", "uA", "kA"), "current"),
    **dict.fromkeys(("µV", "μV", "uV", "kV"), "voltage"),
}
"""Units that no map has, and the quantity that is measured in them."""
AMBIGUOUS = frozenset({"ft", "ft/s", "grad", "grad/s", "gf", "dyn"})
"""Those that are units in brackets only: their letters may be a word."""
BRACKETS = re.compile(r"[\[({<]([^\])}>]*)[\])}>]")
FACTOR = re.compile(
    r"(?<![^\W_])[x×*/] ?10+(?![\d.])|(?<!\d)10 ?\^ ?-?\d+|\d*\.\d+(?= ?[^\W\d_])"
    # As words only before a unit: pi is also a kind of controller.
    r"|(?<![^\W\d_])(?i:pi|π|half|tenths?|hundredths?|thousandths?|kilo|milli|micro)"
    r"(?:[\s_·*-]|of)*(?=(?i:rad|deg|grad|rev|turn|Nm|N[·*. _]m|newton|amp|volt)|[°ANV](?![^\W_]))"
)
"""A factor next to a unit: ``x10``, ``/100``, ``10^-3``, ``0.1 Nm``, ``pi rad``."""
TICK = re.compile(r"(?<![\d.,])(\d+(?:\.\d+)?)([ _]?)(ns|us|µs|μs|ms)(?![^\W_])")
"""Duration of a count in the name of a clock: ``tick_100us``."""
GRAD = "in lower case grad may be a gon, 0.9 degrees"
"""Doubt about the German word for a degree."""


@dataclass(frozen=True)
class UnitInName:
    """A unit in a name, and the rest of the name."""

    rest: str
    unit: str | None
    """None for a unit of a quantity that no map has; without its factor where it is unread."""
    decides: bool
    """Whether it determines the quantity; a letter or a word may mean something else."""
    unread: str = ""
    """Text of a unit that no map has, or of one with a factor: ``0.1 Nm``."""
    doubt: str = ""
    """Another meaning that the unit may have."""

    @property
    def quantity(self) -> str:
        """Quantity that is measured in it; empty where unknown."""
        if self.unread in FOREIGN:
            return FOREIGN[self.unread]
        return QUANTITIES.get(UNITS[self.unit].dimension, "") if self.unit else ""


def unit_in(name: str) -> UnitInName | None:
    """Return the unit in a name; None where it has none."""
    # Brackets first: a unit in them is one for sure, elsewhere the same letters may be a word.
    for bracket in BRACKETS.finditer(name):
        text = bracket[1].strip()
        # "grad" is a gon, and "Grad" a degree: units of no map come before those but for case.
        unit = None if text in OTHERS or text in FOREIGN else _written(text)
        if text in ("h", "d") and not _WORD.search(_without(name, bracket)):
            # Letters that are no unit of anything but a clock.
            return UnitInName(_without(name, bracket), text, decides=False)
        if (unit or text in OTHERS) and not FACTOR.search(_without(name, bracket)):
            return UnitInName(_without(name, bracket), unit, decides=True)
    return _with_factor(name) or _outside_of_brackets(name)


def tick_in(name: str) -> UnitInName | None:
    """Return the duration of a count in the name of a clock; None where it has none."""
    tick = TICK.search(name)
    # Apart from its unit, as in axis_1_us, a number is of something else.
    if tick is None or tick[2]:
        return None
    return UnitInName(_without(name, tick), _written(tick[3]), decides=True, unread=tick[0])


@dataclass(frozen=True)
class ClockUnit:
    """The unit in the name of a clock."""

    text: str
    count_s: float | None
    """Duration of a count, s; None for a unit of something else, such as % of a cycle."""


def clock_unit_in(name: str) -> ClockUnit | None:
    """Return the unit in the name of a column that is a clock; None where it has none."""
    in_name = unit_in(name) or tick_in(name)
    if in_name is None:
        # A clock has no minimum.
        is_min = re.search(r"[\W_]min$", name)
        return ClockUnit("min", UNITS["min"].factor) if is_min else None
    known = UNITS.get(in_name.unit or "")
    is_time = known is not None and known.dimension == "time"
    if in_name.unread:
        count = count_of(in_name.unread)
        count_s = UNITS[count[0]].factor * count[1] if count else None
        return ClockUnit(in_name.unread, count_s)
    # A letter or a word is a unit of time here, or none.
    if known is None or not (is_time or in_name.decides):
        return None
    return ClockUnit(str(in_name.unit), known.factor if is_time else None)


def count_of(unread: str) -> tuple[str, float] | None:
    """Return unit and number of a duration such as ``100us`` or ``0.1 ms``; None for others."""
    tick = TICK.fullmatch(unread)
    unit = _written(tick[3]) if tick else None
    return (unit, float(tick[1])) if tick and unit and float(tick[1]) else None


def _with_factor(name: str) -> UnitInName | None:
    """Return a unit that is a product or has a factor, and that no map has for that; else None."""
    for bracket in BRACKETS.finditer(name):
        text = bracket[1].strip()
        known = text in OTHERS or _written(text)
        if text in FOREIGN:
            return UnitInName(_without(name, bracket), None, decides=True, unread=text)
        has_factor = FACTOR.search(text) or (
            re.search(r"\d", text) and (_WORD.search(text) or "%" in text)
        )
        is_product = re.search(r"[^\W\d_]\s*[*·/^]\s*\w", text)
        if not known and (has_factor or is_product):
            word = None if is_product else _WORD.search(text)
            base = _written(word[0]) if word else None
            return UnitInName(_without(name, bracket), base, decides=True, unread=text)
    rest = FACTOR.sub(" ", name)
    unit = _WORD.search(rest)
    if rest == name or unit is None:
        return None
    factor = " ".join(match[0].strip() for match in FACTOR.finditer(name))
    return UnitInName(
        _without(rest, unit), _written(unit[0]), decides=True, unread=f"{factor} with {unit[0]}"
    )


def _outside_of_brackets(name: str) -> UnitInName | None:
    """Return the last unit among the words of a name, or a letter at its end that is one."""
    matches = list(_WORD.finditer(name)) or list(_LETTER.finditer(name))
    foreign = _FOREIGN_WORD.search(name)
    if foreign is not None and (not matches or matches[-1].re is _LETTER):
        unread = _FOREIGN_WORDS[foreign[0]]
        return UnitInName(_without(name, foreign), None, decides=True, unread=unread)
    if not matches:
        return None
    # The last one, because a unit follows what it is of.
    last = matches[-1]
    unit = _written(last[0])
    if len(matches) > 1 and unit is None:
        # A torque for each kilogram of a person, as Nm_per_kg, is no mass.
        first = matches[-2]
        between = name[first.end() : last.start()]
        if re.fullmatch(r"[\s_]*(?:per|[/·*_]|)[\s_]*", between):
            rest = f"{name[: first.start()]} {name[last.end() :]}"
            text = name[first.start() : last.end()]
            return UnitInName(rest, None, decides=True, unread=text)
    decides = last.re is _WORD and (unit is None or _is_plain(last[0], unit))
    doubt = GRAD if last[0].startswith("grad") and unit in ("deg", "deg/s") else ""
    return UnitInName(_without(name, last), unit, decides, doubt=doubt)


def _without(name: str, match: re.Match[str]) -> str:
    return f"{name[: match.start()]} {name[match.end() :]}"


def _is_plain(text: str, unit: str) -> bool:
    """Return whether a word without brackets is clearly that unit, unlike ``ticks`` or ``ms``."""
    is_word = text.lower() in ("rev", "turn", "turns")
    return not is_word and UNITS[unit].dimension not in ("time", "counts")


def _written(text: str) -> str | None:
    """Return the unit that is written so; case counts for single letters only."""
    return _FORMS.get(text) or (_FOLDED.get(text.casefold()) if len(text) > 1 else None)


def _forms() -> dict[str, str]:
    """Return the spellings of each unit, such as ``rad_s`` and ``deg_per_s``."""
    # An h or a d in a name is a symbol, and a date has no unit.
    forms = {name: name for name in UNITS if name not in ("iso8601", "h", "d")} | ALIASES
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
# `in` and `min` are also words, so they are units in brackets only.
# Longest first, as an alternation takes the first that matches: rad would hide rad/s.
_ANY = "|".join(
    re.escape(text) for text in sorted(_ALONE, key=len, reverse=True) if text not in ("in", "min")
)
# Borders of words in snake_case and camelCase alike: torque_Nm, torqueNm. A single letter is a unit
# only at the end, as in time_s: elsewhere it is a symbol.
# A prefix makes another unit: dNm and daNm are no Nm, although tauNm and qDeg are in camelCase.
_NO_PREFIX = r"(?<!(?<![^\W_])[dcmuµμM])(?<!(?<![^\W_])da)"
_BEFORE = rf"(?:(?<![^\W_])|(?<=[a-z0-9])(?=[A-Z]){_NO_PREFIX})"
_AFTER = r"(?:(?![^\W\d_])|(?=[A-Z][a-z]))"
_WORD = re.compile(rf"{_BEFORE}(?i:{_ANY}){_AFTER}")
_FOREIGN_WORDS = {
    form: text
    for text in FOREIGN
    if text not in AMBIGUOUS
    for form in (text, re.sub("/s$", "_s", text))
}
_FOREIGN_WORD = re.compile(
    rf"(?<![^\W_])(?:{'|'.join(map(re.escape, sorted(_FOREIGN_WORDS, key=len, reverse=True)))})"
    r"(?![^\W_])"
)
_LETTER = re.compile(r"(?<=[^\W_][_\s./,:-])[smAVNKC°%]$")
