"""The dialect of a text file: encoding, delimiter, decimal point, comments, header."""

import codecs
import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from pipelines.errors import InputError
from pipelines.importing.sources.header import (
    Header,
    header,
    is_scaling,
    looks_like_number,
    scaling_of,
    units_left_of,
    units_of,
)
from pipelines.importing.sources.source import numbered_twins
from pipelines.importing.sources.stated import said_to_be_altered
from pipelines.settings.base import repeated
from pipelines.settings.import_map import SourceSettings

DELIMITERS = ",;\t| "
RARE = re.compile(r"[^\w\s.+\-:/\"'#%,;|\0]")
"""Other delimiters, tried where none of ``DELIMITERS`` gives a table."""
FEWEST = 10
"""Least number of rows of a table; fewer are facts about it."""
COMMENTS = ("#", "%", "//")
BYTE_ORDER_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
NOT_A_NUMBER = {"", "nan", "null", "none", "na", "n/a", "inf", "-inf", "-nan", "true", "false"}
# Marks between thousands only with a decimal point: otherwise they may be decimal ones.
NUMBER = {
    decimal: re.compile(
        rf"[-+]?(\d+({point}\d*)?|{point}\d+|\d{{1,3}}({mark}\d{{3}})+{point}\d+)([eE][-+]?\d+)?"
    )
    for decimal, point, mark in ((".", r"\.", ","), (",", ",", r"\."))
}
"""A number, by the decimal mark."""
DATE = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[T\s]+\d{1,2}:\d\d(:\d\d)?")
"""Beginning of a date with its time of day."""


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
    width: int
    """Fields of most rows."""
    numeric: frozenset[str]
    """Columns of numbers."""
    heads: tuple[frozenset[str], ...]
    """Words above each column, by which a header that comes again is recognised."""
    units: Mapping[str, str]
    clocks: Mapping[str, str]
    scaling: Mapping[str, str]
    """Factors and offsets that lines above the rows give to columns."""
    fields_above: tuple[str, ...]
    """Fields above the rows, where those are not the names of the columns."""
    notes: tuple[str, ...]
    stated: tuple[str, ...]
    """Lines above the rows that say that values were corrected."""
    remark: str
    """How the names follow from a header that does not fit; empty where it does."""

    @property
    def separator(self) -> str:
        """The delimiter for pandas; any white space counts as one."""
        return r"\s+" if self.delimiter == " " else self.delimiter

    @property
    def in_words(self) -> str:
        """Delimiter and decimal point, for messages."""
        named = {"\t": "tabs", " ": "spaces"}.get(self.delimiter, repr(self.delimiter))
        return f"{named} between fields and decimal {self.decimal!r}"


def unknown_encoding(encoding: str) -> InputError:
    """Return the error for an encoding in the map that Python does not know."""
    return InputError(f"source.encoding: found {encoding!r}, expected one such as utf-8")


def find_dialect(start: bytes, whole: bool, settings: SourceSettings) -> Dialect:
    """Derive the dialect of a text from its beginning, as far as it is not given.

    Parameters
    ----------
    start : bytes
        Beginning of the text.
    whole : bool
        Whether that is all of it.
    settings : SourceSettings
        What the map says about the text.

    Raises
    ------
    InputError
        If it is no text, or has no table of numbers.
    """
    encoding = settings.encoding or _encoding(start)
    try:
        lines = re.split(r"\r\n?|\n", start.decode(encoding, errors="replace"))
    except LookupError as error:
        raise unknown_encoding(encoding) from error
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
    table.refuse_second()
    named = table.header(below)
    names = settings.columns or named.names
    if len(names) < table.width:
        raise InputError(
            f"has {table.width} columns, but source.columns names {len(names)}; name each of them"
        )
    notes = [f"delimiter {table.delimiter!r}, decimal {table.decimal!r}, {encoding}"]
    if names[0] == "c1" and not named.remark:
        notes.append("no header: columns are named c1, c2, ...")
    starts = Counter(line.lstrip()[:1] for line in lines)
    comment = settings.comment or next((mark for mark in COMMENTS if starts[mark]), None)
    twice = repeated(names)
    if twice:
        notes.append(
            f"columns with the same name are {', '.join(f'{name}#1, {name}#2' for name in twice)}"
        )
    apart = numbered_twins(names)
    remark = "" if settings.columns else named.remark
    return Dialect(
        encoding,
        table.delimiter,
        table.decimal,
        comment,
        skipped + table.first,
        apart,
        table.width,
        frozenset(apart[k] for k in table.numeric),
        table.heads(below),
        {apart[k]: unit for k, unit in table.units(below).items()} | named.units,
        {apart[k]: apart[clock] for k, clock in named.clocks.items()},
        {apart[k]: text for k, text in table.scaling(below).items()},
        table.fields(below) if settings.columns or named.remark else (),
        (*notes, remark) if remark else tuple(notes),
        said_to_be_altered(table.lines_above(below), apart),
        remark,
    )


def _encoding(start: bytes) -> str:
    for mark, encoding in BYTE_ORDER_MARKS.items():
        if start.startswith(mark):
            return encoding
    nuls = start.count(b"\0")
    for first, encoding in ((0, "utf-16-be"), (1, "utf-16-le")):
        # Of letters below 256, one byte of two is NUL.
        if start[first::2].count(b"\0") == nuls > 0.9 * (len(start) // 2):
            return encoding
    if nuls and not _is_stray(nuls, start):
        raise InputError(
            f"is in no known format (it starts with {start[:8]!r}); export it as text, .mat,"
            " Parquet, JSON, HDF5, .xlsx or .tdms"
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
    marks: tuple[str, ...]
    """Of comments."""
    blocks: tuple[tuple[tuple[int, list[str]], ...], ...]
    """Rows under one header each, with their lines' numbers, the longest block first."""
    width: int
    numeric: tuple[int, ...]
    """Columns of numbers."""

    @property
    def first(self) -> int:
        """Line of the first row."""
        return self.blocks[0][0][0]

    @property
    def fields_of_numbers(self) -> int:
        """How many fields of the rows are numbers."""
        return sum(_is_number(field, self.decimal) for _, row in self.blocks[0] for field in row)

    def header(self, lines: Sequence[str]) -> Header:
        """Return the names above the rows."""
        counters = [row[0] for _, row in self.blocks[0]]
        counts_rows = all(field.isdigit() for field in counters) and all(
            int(after) == int(before) + 1 for before, after in pairwise(counters)
        )
        # Between spaces no field is blank: a row with fewer fields lacks any one of them.
        return header(
            self.lines_above(lines), self.width, counts_rows, may_be_longer=self.delimiter != " "
        )

    def scaling(self, lines: Sequence[str]) -> dict[int, str]:
        """Return the factors and offsets above the rows, by the places of their columns."""
        return scaling_of(self.lines_above(lines), self.width)

    def units(self, lines: Sequence[str]) -> dict[int, str]:
        """Return the units that a line, or cells left of the rows, give to columns by places."""
        # Rows left of which settings may stand.
        settings = 50
        of_rows = units_left_of([row for _, row in self.blocks[0][:settings]], self.numeric)
        return of_rows | units_of(self.lines_above(lines), self.width)

    def fields(self, lines: Sequence[str]) -> tuple[str, ...]:
        """Return the fields of all lines above the rows."""
        return tuple(field for line in self.lines_above(lines) for field in line if field)

    def heads(self, lines: Sequence[str]) -> tuple[frozenset[str], ...]:
        """Return the words above each column."""
        above = self.lines_above(lines)
        widest = max(map(len, above), default=0)
        return tuple(frozenset(line[k] for line in above if k < len(line)) for k in range(widest))

    def lines_above(self, lines: Sequence[str]) -> list[list[str]]:
        """Return the fields of the lines above the rows."""
        # Many tools write the header as a comment, so its mark is removed.
        strip = "".join(self.marks) + " "
        return [_fields(line.lstrip(strip), self.delimiter) for line in lines[: self.first]]

    def refuse_second(self) -> None:
        """Raise InputError where another table of some length has another header."""
        others = [block for block in self.blocks[1:] if len(block) >= FEWEST]
        if others:
            first, second = sorted([self.blocks[0][0][0], others[0][0][0]])
            raise InputError(
                f"holds two tables, with rows from lines {first + 1} and {second + 1} on; save"
                " each as a file of its own"
            )


def _tables(
    lines: Sequence[str], delimiters: Sequence[str], settings: SourceSettings
) -> list[_Table]:
    """Return the table of each delimiter and decimal point that give one."""
    # A line that begins with the map's own mark is no row, and may hold the header.
    marks = (settings.comment,) if settings.comment else COMMENTS
    filled = [
        (k, line)
        for k, line in enumerate(lines)
        if line.strip() and not line.lstrip().startswith(marks)
    ]
    tables = []
    for delimiter in delimiters:
        # Without it every line is one field.
        if any(delimiter in line or (delimiter == " " and "\t" in line) for _, line in filled):
            rows = [(k, _fields(line, delimiter)) for k, line in filled]
            rows = [(k, fields) for k, fields in rows if not is_scaling(fields)]
            # A comma may separate fields and be the decimal point of quoted numbers.
            tables += [_table(rows, delimiter, one, marks) for one in settings.decimal or ".,"]
    return [table for table in tables if table is not None]


def _table(
    rows: Sequence[tuple[int, list[str]]], delimiter: str, decimal: str, marks: tuple[str, ...]
) -> _Table | None:
    data = [fields for _, fields in rows if _are_numbers(fields, decimal)]
    if not data:
        return None
    width = Counter(map(len, data)).most_common(1)[0][0]
    data = [fields for fields in data if len(fields) >= width]
    numeric = tuple(
        k
        for k in range(width)
        if 2 * sum(_is_number(fields[k], decimal) for fields in data) > len(data)
    )
    # An empty last field is no field, where every row has one.
    while width > 1 and not any(field for fields in data for field in fields[width - 1 :]):
        width -= 1
    blocks = _blocks(rows, width, numeric, decimal)
    if width < 2 or not blocks:
        return None
    return _Table(delimiter, decimal, marks, blocks, width, numeric)


def _blocks(
    rows: Sequence[tuple[int, list[str]]], width: int, numeric: Sequence[int], decimal: str
) -> tuple[tuple[tuple[int, list[str]], ...], ...]:
    """Return the rows of data between lines of words, the longest block first.

    Lines of words that have come before, as a header that is repeated, end no block.
    """
    blocks: list[list[tuple[int, list[str]]]] = [[]]
    heads: set[tuple[str, ...]] = set()
    for k, fields in rows:
        inside = [fields[column] for column in numeric if column < len(fields)]
        numbers = [looks_like_number(field) for field in inside if not _is_missing(field)]
        if len(fields) >= width and all(numbers) and _are_numbers(fields, decimal):
            blocks[-1].append((k, fields))
        elif len(numbers) == len(numeric) > 1 and not any(numbers) and tuple(fields) not in heads:
            heads.add(tuple(fields))
            blocks.append([])
    return tuple(tuple(block) for block in sorted(blocks, key=len, reverse=True) if block)


def _fields(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        line = line.replace("\t", " ").strip()
    if '"' not in line:  # of whole files, the reader takes most of the time
        return [f.strip() for f in (line.split() if delimiter == " " else line.split(delimiter))]
    return [
        field.strip()
        for field in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    ]


def _are_numbers(fields: list[str], decimal: str) -> bool:
    # Least share of numbers among the fields of a row of data; others are dates and states.
    enough = 0.5
    numbers = sum(_is_number(field, decimal) for field in fields)
    # A date and one number are the least row of a log that is one of several files of a run.
    dated = numbers == 1 and any(DATE.match(field) for field in fields)
    return (numbers >= 2 or dated) and numbers >= enough * sum(
        not _is_missing(field) for field in fields
    )


def is_value(field: str, decimal: str) -> bool:
    """Return whether a field is a number, or a word for one such as nan."""
    return field != "" and (_is_missing(field) or _is_number(field, decimal))


def _is_missing(field: str) -> bool:
    return field.lower() in NOT_A_NUMBER


def _is_number(field: str, decimal: str) -> bool:
    return NUMBER[decimal].fullmatch(field) is not None
