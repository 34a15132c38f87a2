"""The names of a text table's columns, from the lines above its rows."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from pipelines.settings.units import unit_named

UNIT = r"[\[(].*[\])]|[-\w°µ/·*%.²]{1,5}|[^\W\d]{1,3}([·*./][^\W\d]{1,3}){1,3}"
"""Pattern of a possible unknown unit: in brackets, or short, or a product as ``N.mm/kg``."""
_OF_FACTORS = (
    "factor factors scale scaling scalefactor gain gains multiplier slope sensitivity resolution",
    "faktor faktoren skalierung skalierungsfaktor verstärkung empfindlichkeit steigung auflösung",
    "facteur échelle sensibilité",
)
FACTORS = frozenset(word for words in _OF_FACTORS for word in words.split())
OFFSETS = frozenset({"offset", "offsets", "bias", "nullpunkt", "décalage"})
"""Words that begin a line of numbers by which the values below may have to be scaled."""
UNITS_OF_VALUES = frozenset(
    {"unit", "units", "verticalunit", "verticalunits", "yunit", "yunits", "einheit", "einheiten"}
)
"""Words that begin a line of the values' units; that of the clock is another one."""
Line = Sequence[str]


@dataclass(frozen=True)
class Header:
    """Names of columns, as far as lines above the rows have them."""

    names: tuple[str, ...]
    units: dict[str, str] = field(default_factory=dict)
    """Units that a line of their own gives to columns."""
    clocks: dict[int, int] = field(default_factory=dict)
    """Place of the clock of each column, where the names show several clocks."""
    remark: str = ""
    """How the names follow from lines that do not fit the rows."""


def is_scaling(line: Line) -> bool:
    """Return whether a line has factors or offsets of the columns, not a row of their values."""
    return bool(line) and _key(line[0]) in FACTORS | OFFSETS and len(line) > 1


def _key(text: str) -> str:
    """Return the word that begins a line, without marks and a unit."""
    return re.sub(r"[\[(].*|[:=].*", "", text).replace(" ", "").replace("_", "").casefold()


def scaling_of(above: Sequence[Line], width: int) -> dict[int, str]:
    """Return the factors other than 1 and offsets other than 0 of columns, by their places.

    Parameters
    ----------
    above : sequence of sequences of str
        Fields of the lines above the rows, without marks of comments.
    width : int
        Fields of a row.
    """
    scaling: dict[int, str] = {}
    for line in above:
        stripped = _stripped(line)
        if not is_scaling(stripped) or len(stripped) not in (width, width + 1):
            continue
        # A line may have its key before the first column, or in its place.
        for k, text in enumerate(stripped[1:], 1 if len(stripped) == width else 0):
            neutral = 1.0 if _key(line[0]) in FACTORS else 0.0
            if looks_like_number(text) and not _is(text, neutral):
                scaling[k] = ", ".join(filter(None, (scaling.get(k), f"{line[0].strip()} {text}")))
    return scaling


def units_of(above: Sequence[Line], width: int) -> dict[int, str]:
    """Return the units of columns that a line with a key gives, by their places.

    Parameters
    ----------
    above : sequence of sequences of str
        Fields of the lines above the rows, without marks of comments.
    width : int
        Fields of a row.
    """
    units: dict[int, str] = {}
    for line in above:
        stripped = _stripped(line)
        if not stripped or _key(stripped[0]) not in UNITS_OF_VALUES:
            continue
        # The key may stand before the first column, or in its place, as above a clock.
        if len(stripped) in (width, width + 1):
            first = 1 if len(stripped) == width else 0
            units |= {k: unit for k, unit in enumerate(stripped[1:], first) if unit_named(unit)}
    return units


def units_left_of(rows: Sequence[Line], numeric: Sequence[int]) -> dict[int, str]:
    """Return the unit of all values that an oscilloscope writes to the left of its rows.

    Parameters
    ----------
    rows : sequence of sequences of str
        Fields of the first rows.
    numeric : sequence of int
        Places of the columns of numbers, of which the first is the clock.
    """
    units = {
        row[1].strip()
        for row in rows
        if len(row) > 1 and _key(row[0]) in UNITS_OF_VALUES and unit_named(row[1].strip())
    }
    return dict.fromkeys(numeric[1:], units.pop()) if len(units) == 1 else {}


def _is(text: str, number: float) -> bool:
    try:
        return float(text.replace(",", ".")) == number
    except ValueError:  # marks between thousands
        return False


def header(
    above: Sequence[Line], width: int, counts_rows: bool, may_be_longer: bool = True
) -> Header:
    """Return the names above rows of a width, or numbers where no line fits.

    Parameters
    ----------
    above : sequence of sequences of str
        Fields of the lines above the rows, without marks of comments.
    width : int
        Fields of a row.
    counts_rows : bool
        Whether the first column counts rows by one.
    may_be_longer : bool
        Whether names beyond the width belong to columns that are empty in most rows.
    """
    lines = [line for line in above if len(_stripped(line)) > 1]
    by_key = _by_key([line for line in lines if _fits(line, width)])
    if by_key is not None:
        return by_key
    # Numbers above the names are facts about the columns, such as gains.
    words = [line for line in lines if not any(map(looks_like_number, line))]
    last = _stripped(words[-1]) if words else []
    names: tuple[str, ...] = ()
    fitting = [k for k, line in enumerate(words) if _fits(line, width)]
    if len(last) > width and may_be_longer:  # a column more at the end, which is empty in most rows
        names = _filled(last)
    elif fitting:
        names = _names([_padded(line, width) for line in words[: fitting[-1] + 1]])
    if names:
        return Header(names, clocks=_clocks([_is_x(name) for name in names]))
    if len(last) == width - 1 and counts_rows:  # as R writes row names
        return Header(("row", *_filled(last)), remark="row numbers have no name; called row")
    numbered = tuple(f"c{k + 1}" for k in range(width))
    if not last:
        return Header(numbered)
    return Header(
        numbered,
        remark=f"the header {', '.join(last)[:60]!r} has {len(last)} names, the rows {width}"
        " fields: name them in source.columns",
    )


def _names(lines: Sequence[Line]) -> tuple[str, ...]:
    """Return the names in the last of lines of equal width, with those above that it belongs to."""
    lines = _without_descriptions(lines)
    last, over = lines[-1], _over(lines[:-1])
    if over and _are_units(last):
        return tuple(
            f"{name} [{unit.strip('[]()')}]" if unit else name
            for name, unit in zip(_names(lines[:-1]), last, strict=True)
        )
    # Names that occur again and again are parts of those above, as X and Y of a position.
    named = [name for name in last if name]
    if over and len(set(named)) < len(named):
        return tuple(_part(name, part) for name, part in zip(over, last, strict=True))
    return _filled(last)


def _without_descriptions(lines: Sequence[Line]) -> Sequence[Line]:
    """Return the lines up to that of the units, if each column has a name of its own above it."""
    for k in range(1, len(lines) - 1):
        names = set(lines[k - 1])
        if _are_units(lines[k]) and "" not in names and len(names) == len(lines[k - 1]):
            return lines[: k + 1]
    return lines


def _is_x(name: str) -> bool:
    """Return whether a name is that of an oscilloscope's or of LabVIEW's clock."""
    return name.casefold().endswith("[x]") or name == "X_Value"


def _clocks(is_clock: Sequence[bool]) -> dict[int, int]:
    """Return the clock before each other column, if there are several clocks."""
    clocks: dict[int, int] = {}
    last = None
    for k, clock in enumerate(is_clock):
        last = k if clock else last
        if last is not None and not clock:
            clocks[k] = last
    return clocks if sum(is_clock) > 1 else {}


def _over(lines: Sequence[Line]) -> list[str]:
    """Return the names of the line above, each carried on over blank fields; empty without one."""
    names: list[str] = []
    for name in lines[-1] if lines else ():
        names.append(name or (names[-1] if names else ""))
    return names if len(set(names)) > 1 else []


def _part(name: str, part: str) -> str:
    if len(part) == 1:
        return f"{name} [{part}]"
    return f"{name} {part}".strip()


def _are_units(fields: Line) -> bool:
    """Return whether fields are units: all short or in brackets, and half of them known."""
    units = [field for field in fields if field]
    known = sum(unit_named(unit.strip("[]()")) is not None for unit in units)
    return 2 * known >= len(units) and all(
        unit_named(unit) or re.fullmatch(UNIT, unit) for unit in units
    )


def _by_key(lines: Sequence[Line]) -> Header | None:
    """Return the names of TwinCAT Scope: a line for each fact, whose key stands at every clock."""
    facts = {line[0]: line for line in lines}
    names = facts.get("Name")
    if names is None or not any(key.startswith("SampleTime") for key in facts):
        return None
    units = facts.get("Unit", ())
    called: list[str] = []
    known: dict[str, str] = {}
    for k, name in enumerate(names):
        if name != "Name":
            called.append(name or f"c{k + 1}")
            if k < len(units) and unit_named(units[k]):
                known[called[-1]] = units[k]
            continue
        first = names[k + 1] if k + 1 < len(names) else ""
        called.append(f"time of {first} [ms]" if names.count("Name") > 1 else "time [ms]")
    return Header(tuple(called), known, _clocks([name == "Name" for name in names]))


def _fits(line: Line, width: int) -> bool:
    return len(_stripped(line)) == width or len(_stripped(line)) <= width == len(line)


def _stripped(line: Line) -> list[str]:
    """Return fields without empty ones at the end."""
    fields = list(line)
    while fields and not fields[-1]:
        fields.pop()
    return fields


def _padded(line: Line, width: int) -> list[str]:
    return [*line, *[""] * width][:width]


def _filled(names: Line) -> tuple[str, ...]:
    """Return names, numbered where one is missing."""
    return tuple(name or f"c{k}" for k, name in enumerate(names, 1))


def looks_like_number(text: str) -> bool:
    """Return whether text may be a number, with any marks between its digits."""
    return re.fullmatch(r"[-+]?[\d.,]*\d[\d.,]*([eE][-+]?\d+)?", text) is not None
