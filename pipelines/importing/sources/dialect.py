"""The dialect of a text file: encoding, delimiter, decimal point, comments, header."""

import codecs
import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipelines.errors import InputError
from pipelines.settings.base import repeated
from pipelines.settings.import_map import SourceSettings
from pipelines.settings.units import unit_named

DELIMITERS = ",;\t| "
RARE = re.compile(r"[^\w\s.+\-:/\"'#%,;|\0]")
"""Other delimiters, tried where none of ``DELIMITERS`` gives a table."""
COMMENTS = ("#", "%")
BYTE_ORDER_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
NOT_A_NUMBER = {"", "nan", "null", "none", "na", "n/a", "inf", "-inf", "-nan", "true", "false"}

UNIT = r"[\[(].*[\])]|[-\w°µ/·*%.²]{1,5}"
"""Pattern of a possible unknown unit: in brackets, or short."""


@dataclass(frozen=True)
class Dialect:
    """How a text file is to be parsed."""

    encoding: str
    delimiter: str
    decimal: str
    comment: str | None
    rows_before: int
    """Lines before the first one of data."""
    names: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def separator(self) -> str:
        """The delimiter for pandas; any white space counts as one."""
        return r"\s+" if self.delimiter == " " else self.delimiter

    @property
    def in_words(self) -> str:
        """Delimiter and decimal point, for messages."""
        named = {"\t": "tabs", " ": "spaces"}.get(self.delimiter, repr(self.delimiter))
        return f"{named} between fields and decimal {self.decimal!r}"


def find_dialect(path: Path, settings: SourceSettings) -> Dialect:
    """Derive the dialect of a text file from its first lines, as far as it is not given.

    Raises
    ------
    InputError
        If the file is no text, or has no table of numbers.
    """
    # Bytes at the beginning of a file from which its dialect is derived.
    looked_at = 2**16
    with open(path, "rb") as file:
        start = file.read(looked_at)
        whole = not file.read(1)
    encoding = settings.encoding or _encoding(start)
    try:
        lines = start.decode(encoding, errors="replace").splitlines()
    except LookupError as error:
        raise InputError(
            f"source.encoding: found {encoding!r}, expected one such as utf-8"
        ) from error
    # The limit of bytes may have cut the last line in two.
    lines = lines if whole else lines[:-1]
    skipped = settings.skip_rows or 0
    below = lines[skipped:]
    tables = _tables(below, settings.delimiter or DELIMITERS, settings)
    if not tables and not settings.delimiter:
        tables = _tables(below, sorted(set(RARE.findall("".join(below)))), settings)
    if not tables:
        raise InputError(_no_table(lines, settings))
    # A wrong delimiter leaves several numbers in one field, which is then none.
    table = max(tables, key=lambda table: table.fields_of_numbers)
    names = settings.columns or table.header(below)
    if len(names) != table.width:
        raise InputError(
            f"has {table.width} columns, but source.columns names {len(names)}; name each of them"
        )
    notes = [f"delimiter {table.delimiter!r}, decimal {table.decimal!r}, {encoding}"]
    if names == table.numbered:
        notes.append("no header: columns are named c1, c2, ...")
    starts = Counter(line.lstrip()[:1] for line in lines)
    comment = settings.comment or next((mark for mark in COMMENTS if starts[mark]), None)
    twice = repeated(names)
    if twice:
        notes.append(
            f"columns with the same name are {', '.join(f'{name}#1, {name}#2' for name in twice)}"
        )
    return Dialect(
        encoding,
        table.delimiter,
        table.decimal,
        comment,
        skipped + table.first,
        _numbered_twins(names),
        tuple(notes),
    )


def _encoding(start: bytes) -> str:
    for mark, encoding in BYTE_ORDER_MARKS.items():
        if start.startswith(mark):
            return encoding
    nuls = start.count(b"\0")
    if nuls and not _is_stray(nuls, start):
        raise InputError(
            f"is in no known format (it starts with {start[:8]!r}); export it as text, .mat,"
            " Parquet, JSON, HDF5, MCAP or ROS 2 bag"
        )
    try:
        # Incremental, as the last character may be cut in two.
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        # The usual encoding of Windows in Western Europe, where ° and µ are single bytes.
        return "cp1252"
    return "utf-8"


def _is_stray(nuls: int, start: bytes) -> bool:
    """Return whether NUL bytes are faults in a text, as of a full disk: few, none in the header."""
    # Share of NUL bytes up to which a file may be a damaged text; UTF-16 has half.
    stray = 0.1
    return nuls < stray * len(start) and b"\0" not in start.partition(b"\n")[0]


def _no_table(lines: Sequence[str], settings: SourceSettings) -> str:
    if not any(line.strip() for line in lines):
        return "is empty, expected a table of numbers; record it again"
    how = f" with delimiter {settings.delimiter!r}" if settings.delimiter else ""
    header = lines[settings.skip_rows or 0 :][:1]
    return (
        f"holds no rows of two numbers or more{how} after {header[0][:60]!r}; "
        "check that it is a log, or describe it in the map's [source]"
        if header
        else "has fewer lines than source.skip_rows; lower it"
    )


@dataclass(frozen=True)
class _Table:
    """The rows of numbers that a delimiter and a decimal point give."""

    delimiter: str
    decimal: str
    comment_marks: tuple[str, ...]
    first: int
    """Line of the first row."""
    width: int
    fields_of_numbers: int

    @property
    def numbered(self) -> tuple[str, ...]:
        """Names of columns without a header."""
        return tuple(f"c{k + 1}" for k in range(self.width))

    def header(self, lines: Sequence[str]) -> tuple[str, ...]:
        """Return the names above the rows: the last line with as many fields as a row.

        If that line holds units, they are appended to the names in the line before.
        """
        # Many tools write the header as a comment, so its mark is removed.
        above = [
            _fields(line.lstrip("".join(self.comment_marks) + " "), self.delimiter)
            for line in lines[: self.first]
        ]
        fitting = [fields for fields in above if len(fields) == self.width and any(fields)]
        if not fitting:
            return self.numbered
        names, *before = reversed(fitting)
        names = [name or number for name, number in zip(names, self.numbered, strict=True)]
        if before and all(unit_named(field) or re.fullmatch(UNIT, field) for field in names):
            names = [
                f"{name} [{unit.strip('[]()')}]"
                for name, unit in zip(before[0], names, strict=True)
            ]
        return tuple(names)


def _tables(
    lines: Sequence[str], delimiters: Sequence[str], settings: SourceSettings
) -> list[_Table]:
    """Return the table of each delimiter and decimal point that give one."""
    # A line that begins with the map's own mark is no row, and may hold the header.
    marks = (settings.comment,) if settings.comment else COMMENTS
    tables = [
        _table(lines, delimiter, decimal, marks)
        for delimiter in delimiters
        # A comma cannot separate fields and be the decimal point, too.
        for decimal in settings.decimal or ("." if delimiter == "," else ".,")
    ]
    return [table for table in tables if table is not None]


def _table(
    lines: Sequence[str], delimiter: str, decimal: str, marks: tuple[str, ...]
) -> _Table | None:
    rows = [
        (k, _fields(line, delimiter))
        for k, line in enumerate(lines)
        if not line.lstrip().startswith(marks)
    ]
    data = [(k, fields) for k, fields in rows if _are_numbers(fields, decimal)]
    if not data:
        return None
    width = Counter(len(fields) for _, fields in data).most_common(1)[0][0]
    data = [(k, fields) for k, fields in data if len(fields) == width]
    numbers = sum(_is_number(field, decimal) for _, fields in data for field in fields)
    return _Table(delimiter, decimal, marks, data[0][0], width, numbers) if width > 1 else None


def _fields(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    return [
        field.strip()
        for field in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    ]


def _are_numbers(fields: list[str], decimal: str) -> bool:
    # Least share of numbers among the fields of a row of data; others are dates and states.
    enough = 0.5
    numbers = sum(_is_number(field, decimal) for field in fields)
    return numbers >= 2 and numbers >= enough * sum(
        field.lower() not in NOT_A_NUMBER for field in fields
    )


def _is_number(field: str, decimal: str) -> bool:
    point = re.escape(decimal)
    return re.fullmatch(rf"[-+]?(\d+({point}\d*)?|{point}\d+)([eE][-+]?\d+)?", field) is not None


def _numbered_twins(names: Sequence[str]) -> tuple[str, ...]:
    """Add numbers to names that occur twice: two columns ``q`` become ``q#1`` and ``q#2``."""
    times, seen = Counter(names), Counter[str]()
    apart = []
    for name in names:
        seen[name] += 1
        apart.append(name if times[name] == 1 else f"{name}#{seen[name]}")
    return tuple(apart)
