"""Logs of LabVIEW in text (.lvm) whose clock is in their headers, or that have several headers.

Tags as in NI's "Specification for the LabVIEW Measurement File (.lvm)".
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.errors import InputError
from pipelines.importing.finding import counted
from pipelines.importing.sources.dialect import unknown_encoding
from pipelines.importing.sources.source import Columns, Source, numbered_twins
from pipelines.importing.sources.text import open_text
from pipelines.settings.import_map import SourceSettings
from pipelines.settings.units import unit_named

MAGIC = b"LabVIEW Measurement"
END = "***End_of_Header***"
X = "X_Value"
"""Name of a column of times, s."""


@dataclass(frozen=True)
class _Segment:
    """The rows of one write, or of several, under one header."""

    tags: Mapping[str, Sequence[str]]
    """Values of each tag of the header, one for each column but the first."""
    names: tuple[str, ...]
    table: pd.DataFrame

    def numbers_of(self, tag: str, decimal: str) -> list[float]:
        """Return the numbers of a tag; none where the header lacks it."""
        texts = (text.replace(decimal, ".") for text in self.tags.get(tag, ()) if text.strip())
        return [float(text) for text in texts]

    @property
    def began_s(self) -> float:
        """Its date and time, s since 1970; NaN where it has none."""
        texts = [next((t for t in self.tags.get(tag, ()) if t), "") for tag in ("Date", "Time")]
        written = " ".join(texts).replace("/", "-").replace(",", ".").strip()
        # Nanoseconds at most: LabVIEW writes more digits.
        whole, _, fraction = written.partition(".")
        stamp = f"{whole}.{fraction[:9] or 0}"
        at = pd.to_datetime(stamp, errors="coerce", utc=True)
        return np.nan if pd.isna(at) else float(at.timestamp())


def open_lvm(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a .lvm file.

    Where ``X_Columns`` is "No", ``X_Value`` is X0 + row * Delta_X of the header. Segments follow
    each other in one table; X values that start over count from the date and time of their segment.

    Raises
    ------
    InputError
        If the file is damaged, or its segments have different columns.
    """
    # Bytes that hold the header of the file.
    header_bytes = 2**14
    with open(path, "rb") as file:
        head = _decoded(file.read(header_bytes), settings).partition(END)[0]
        file.seek(0)
        segments = sum(line.startswith(b"Channels") for line in file)
    tags = dict(_tag(line) for line in head.splitlines())
    has_x = tags.get("X_Columns", "One") != "No"
    by_hand = {"delimiter", "skip_rows", "columns"} & settings.model_fields_set
    if by_hand or not segments or (has_x and segments == 1):
        return open_text(path, settings)
    body = _decoded(path.read_bytes(), settings).partition(END)[2]
    separator = "," if tags.get("Separator") == "Comma" else "\t"
    decimal = tags.get("Decimal_Separator", ".") or "."
    parts = list(_segments(body, separator, decimal))
    if not parts:
        raise InputError("has no segment with rows of data; record it again")
    for one, other in pairwise(parts):
        if one.names != other.names:
            raise InputError(
                f"holds segments with different columns, {', '.join(one.names)[:60]!r} and"
                f" {', '.join(other.names)[:60]!r}; save each as a file of its own"
            )
    notes = [f"{counted(len(parts), 'segment')}, decimal {decimal!r}"]
    remarks: list[str] = []
    if not has_x:
        notes.append("times by X0 and Delta_X of the header")
        parts = [_with_x(one, decimal, remarks) for one in parts]
    return _source(path, parts, notes, remarks)


def _decoded(content: bytes, settings: SourceSettings) -> str:
    encoding = settings.encoding or "utf-8"
    try:
        return content.decode(encoding)
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")
    except LookupError as error:
        raise unknown_encoding(encoding) from error


def _tag(line: str) -> tuple[str, str]:
    """Return the tag and the value of a line of the file's header, whatever separates them."""
    for separator in "\t,":
        tag, mark, value = line.partition(separator)
        if mark:
            return tag.strip(), value.strip("\t ") if separator == "\t" else value.rstrip(",")
    return line.strip(), ""


def _segments(body: str, separator: str, decimal: str) -> Iterator[_Segment]:
    """Yield the segments below the file's header that have rows."""
    tags: dict[str, list[str]] = {}
    rows: list[str] = []
    names: tuple[str, ...] = ()
    above = True
    for line in _without_special_blocks(body.splitlines()):
        fields = line.split(separator)
        if fields[0] == "Channels":
            if rows:
                yield _Segment(tags, names, _table(rows, names, separator, decimal))
            tags, names, rows, above = {}, (), [], True
        if above:
            above = fields[0] != END
            tags[fields[0]] = fields[1:]
        elif not names:
            names = tuple(line.rstrip(separator + " ").split(separator))
        elif line.strip():
            rows.append(line)
    if rows:
        yield _Segment(tags, names, _table(rows, names, separator, decimal))


def _without_special_blocks(lines: Iterable[str]) -> Iterator[str]:
    """Yield the lines outside of blocks that programs add for themselves."""
    inside = False
    for line in lines:
        inside = inside or line.startswith("***Start_Special***")
        if not inside:
            yield line
        inside = inside and not line.startswith("***End_Special***")


def _table(rows: Sequence[str], names: Sequence[str], separator: str, decimal: str) -> pd.DataFrame:
    try:
        return pd.read_csv(
            StringIO("\n".join(rows)),
            sep=separator,
            decimal=decimal,
            header=None,
            names=[*range(len(names))],
            index_col=False,
            skipinitialspace=True,
        )
    except (pd.errors.ParserError, ValueError) as error:
        raise InputError(f"cannot be read as a .lvm file ({error}); export it again") from error


def _with_x(segment: _Segment, decimal: str, remarks: list[str]) -> _Segment:
    """Return a segment with the times of its rows, one column for each different clock."""
    starts, steps = (segment.numbers_of(tag, decimal) for tag in ("X0", "Delta_X"))
    samples = segment.numbers_of("Samples", decimal)
    clocks = list(dict.fromkeys(zip(starts, steps, strict=False)))
    rows = len(segment.table)
    if not clocks or (max(samples, default=rows) <= 1 < rows):
        # A header of one sample has the time of that row alone.
        remarks.append("no row has a time, nor a header for more than one row: set time.rate_hz")
        return segment
    if samples and rows > max(samples):
        remarks.append(
            f"{rows} rows under a header for {max(samples):.0f}: taken to go on without a pause"
        )
    if len(clocks) > 1:
        return _with_several_x(segment, list(zip(starts, steps, strict=False)))
    table = segment.table.copy()
    table[0] = _times(clocks[0], rows)
    return _Segment(segment.tags, segment.names, table)


def _with_several_x(segment: _Segment, clocks: Sequence[tuple[float, float]]) -> _Segment:
    """Return a segment in which each channel has its times in the column before it."""
    names: list[str] = []
    columns: list[NDArray] = []
    for k, name in enumerate(segment.names[1:], 1):
        values = segment.table[k].to_numpy()
        if k <= len(clocks):
            names.append(X)
            columns.append(np.where(pd.isna(values), np.nan, _times(clocks[k - 1], len(values))))
        names.append(name)
        columns.append(values)
    table = pd.DataFrame(dict(enumerate(columns)))
    return _Segment(segment.tags, tuple(names), table)


def _times(clock: tuple[float, float], rows: int) -> NDArray:
    start_s, step_s = clock
    return start_s + step_s * np.arange(rows)


def _source(
    path: Path, segments: Sequence[_Segment], notes: Sequence[str], remarks: Sequence[str]
) -> Source:
    """Return the segments as one table."""
    names = numbered_twins(segments[0].names)
    is_clock = [name == X for name in segments[0].names]
    columns: Columns = {}
    clocks: dict[str, str] = {}
    clock = ""
    for k, name in enumerate(names):
        parts = [one.table[k].to_numpy() for one in segments]
        if is_clock[k]:
            clock = name
            parts = _one_clock([_numbers(part) for part in parts], segments)
        values = np.concatenate(parts)
        # LabVIEW adds a column of comments, which are few or none.
        if pd.isna(values).all():
            continue
        columns[name] = values
        if sum(is_clock) > 1 and not is_clock[k]:
            clocks[name] = clock
    return Source.in_memory(
        path,
        "LabVIEW",
        columns,
        notes=tuple(notes),
        units=_units(segments[0], names, is_clock),
        clocks=clocks,
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _numbers(values: NDArray) -> NDArray:
    return np.asarray(pd.to_numeric(pd.Series(values), errors="coerce"), dtype=float)


def _one_clock(parts: Sequence[NDArray], segments: Sequence[_Segment]) -> list[NDArray]:
    """Return the times of segments since the first one's date and time.

    Times that go on from the segment before count from its origin. Those that start over count
    from the date and time of their own segment.
    """
    times = [parts[0]]
    for part, segment in zip(parts[1:], segments[1:], strict=True):
        since_s = segment.began_s - segments[0].began_s
        starts_over = np.isfinite(part).any() and np.nanmin(part) <= np.nanmax(times[-1])
        times.append(part + since_s if starts_over and np.isfinite(since_s) else part)
    return times


def _units(segment: _Segment, names: Sequence[str], is_clock: Sequence[bool]) -> dict[str, str]:
    """Return the units of the columns that the header gives in a known form."""
    units = {name: "s" for name, clock in zip(names, is_clock, strict=True) if clock}
    channels = [name for name, clock in zip(names, is_clock, strict=True) if not clock]
    labels = segment.tags.get("Y_Unit_Label", ())
    # Without a column of times for each channel, a label stands above each of the channels.
    given = [label for label in labels if label] if len(channels) < len(labels) else labels
    for name, label in zip(channels, given, strict=False):
        if unit_named(label):
            units[name] = label
    return units
