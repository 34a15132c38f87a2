"""What a file says of its columns, where its map says something else."""

from collections.abc import Iterator, Sequence
from math import isclose

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.channel import Channel
from pipelines.importing.finding import Finding
from pipelines.importing.naming.meaning import TWIN, derived, meaning
from pipelines.importing.naming.unit_in_name import clock_unit_in, unit_in
from pipelines.importing.quantities.conversion import columns_of
from pipelines.importing.quantities.numbers import numbers
from pipelines.importing.sources.source import Columns, Source
from pipelines.importing.sources.stated import is_altered
from pipelines.settings.import_map import TimeSettings
from pipelines.settings.units import ALIASES, UNITS

SQUARES_TO_ONE = 0.01
"""Largest error of the sum of the squares of a sine and a cosine."""


def contradictions(
    channels: Sequence[Channel], columns: Columns, time: TimeSettings, source: Source
) -> Iterator[Finding]:
    """Report what the file says of channels and clocks that the map contradicts.

    The map is followed, as its author may know better.

    Parameters
    ----------
    channels : sequence of Channel
        Of the map.
    columns : Columns
        (n,) each, by their names in the map.
    time : TimeSettings
        Of the map.
    source : Source
        The file.
    """
    yield from _stated(channels, source)
    yield from _scaling(channels, source)
    yield from _other_units(channels, source)
    yield from _units_above(channels, source)
    yield from _derived(channels, columns, source)
    yield from _other_units_of_clocks(channels, columns, time, source)
    if time.column is not None:
        yield from _clocks_in_the_same_rows(channels, columns, time, source)


def _stated(channels: Sequence[Channel], source: Source) -> Iterator[Finding]:
    """Report what the file says in words of its values, which no map holds."""
    action = (
        "read as they are; all that the drive gives must be in its torque, and no zero may move"
    )
    for words in source.stated:
        yield Finding("rows", f"the file says {words}", action)
    for channel in channels:
        for name in columns_of(channel.reading, channel.where):
            if is_altered(source.column_named(name)):
                yield Finding(
                    channel.target, f"its name says that it was altered: {name!r}", action
                )


def _scaling(channels: Sequence[Channel], source: Source) -> Iterator[Finding]:
    """Report factors and offsets in the file of which the map knows nothing."""
    for channel in channels:
        if channel.reading.model_fields_set & {"scale", "expression"}:
            continue
        for name in columns_of(channel.reading, channel.where):
            text = source.scaling.get(source.column_named(name))
            if text is not None:
                action = "taken to be in the values; if not, set scale and zero"
                yield Finding(channel.target, f"the file says {text} of {name!r}", action)


def _other_units(channels: Sequence[Channel], source: Source) -> Iterator[Finding]:
    """Report units in the file, next to a column or in its name, that are not those of the map."""
    for channel in channels:
        reading = channel.reading
        # A scale says that the map's author knows better; without it names and units agree.
        if reading.column is None or "scale" in reading.model_fields_set:
            continue
        name = source.column_named(reading.column)
        in_name = unit_in(_with_unit(name, source))
        if in_name is None or not in_name.decides or in_name.doubt:
            continue
        known = UNITS.get(in_name.unit or "")
        if not in_name.unread and (known is None or known == reading.known_unit):
            continue
        seen = f"the file says {in_name.unread or in_name.unit} of {name!r}, the map {reading.unit}"
        yield Finding(
            channel.target, seen, "read as the map says; correct unit, or set scale = 1 if right"
        )


def _with_unit(name: str, source: Source) -> str:
    """Return the name of a column, with the unit that the file has next to it."""
    plain, unit = TWIN.sub("", name), source.units.get(name)
    return f"{plain} [{unit}]" if unit else plain


def _derived(channels: Sequence[Channel], columns: Columns, source: Source) -> Iterator[Finding]:
    """Report changes of an angle, and sines or cosines of it, that the map has as the angle."""
    others: Columns | None = None
    for channel in channels:
        name = channel.reading.column
        if name is None or not channel.where.endswith(".angle"):
            continue
        action = "read as an angle, as the map says; log the angle itself"
        if derived(source.column_named(name)):
            yield Finding(
                channel.target,
                f"the name of {name!r} says a change from row to row, or a function of an angle",
                action,
            )
        elif _may_be_a_sine(columns[name]):
            if others is None:
                loaded = source.load([one for one in source.names if one not in columns])
                others = {other: numbers(raw) for other, raw in loaded.items()}
            if (other := _other_leg(columns[name], others)) is not None:
                seen = f"{name!r} and {other!r} are sine and cosine: their squares add to 1"
                yield Finding(channel.target, seen, action)


def _may_be_a_sine(values: NDArray) -> bool:
    """Return whether values (n,) lie within -1 and 1."""
    known = values[np.isfinite(values)] if values.dtype.kind == "f" else np.zeros(0)
    return 0.0 < float(np.max(known**2, initial=0.0)) <= 1.0 + SQUARES_TO_ONE


def _other_leg(values: NDArray, others: Columns) -> str | None:
    """Return the column whose square, and that of values (n,), add to 1 in all rows, if any."""
    # Largest part of the change of a square that noise and rounded digits leave in the sum.
    share = 0.1
    rows = np.isfinite(values)
    square = values[rows] ** 2
    for name, other in others.items():
        if len(other) != len(values):
            continue
        total = square + other[rows] ** 2
        if np.std(total) < share * np.std(square) and abs(np.mean(total) - 1.0) < SQUARES_TO_ONE:
            return name
    return None


def _other_units_of_clocks(
    channels: Sequence[Channel], columns: Columns, time: TimeSettings, source: Source
) -> Iterator[Finding]:
    """Report units of clocks in the file that are not those of the map."""
    stated = "scale" in time.model_fields_set
    clocks = {} if stated else {time.column: time.unit, time.plus: time.plus_unit}
    for channel in channels:
        reading = channel.reading
        if reading.time_scale is None and not (reading.time_unit is None and stated):
            clocks.setdefault(channel.time, reading.time_unit or time.unit)
    for column, unit in clocks.items():
        # Dates are in no unit, and typed durations know theirs.
        if column is None or columns[column].dtype.kind in "mM" or unit == "iso8601":
            continue
        name = source.column_named(column)
        in_name = clock_unit_in(_with_unit(name, source))
        factor = UNITS[ALIASES.get(unit, unit)].factor
        if in_name is None or isclose(in_name.count_s or 0.0, factor):
            continue
        seen = f"the file says {in_name.text} of {name!r}, the map {unit}"
        yield Finding("time", seen, "read as the map says; correct unit, or set scale if right")


def _units_above(channels: Sequence[Channel], source: Source) -> Iterator[Finding]:
    """Report units of a quantity in lines that do not name the columns, if the map has others."""
    above = [one for one in map(unit_in, source.fields_above) if one and one.unit and one.decides]
    for channel in channels:
        reading = channel.reading
        if "scale" in reading.model_fields_set:
            continue
        alike = {
            str(one.unit): UNITS[str(one.unit)]
            for one in above
            if UNITS[str(one.unit)].dimension == reading.known_unit.dimension
        }
        if alike and reading.known_unit not in alike.values():
            seen = f"the lines above the rows say {' and '.join(alike)}, the map {reading.unit}"
            action = "read as the map says; correct unit, or set scale = 1 if right"
            yield Finding(channel.target, seen, action)


def _clocks_in_the_same_rows(
    channels: Sequence[Channel], columns: Columns, time: TimeSettings, source: Source
) -> Iterator[Finding]:
    """Report channels that end, or are blank, where another clock in the file is.

    A logger of several rates writes a block of columns for each, and a row of one block is at
    another time than the same row of another.
    """
    stamps = columns[str(time.column)]
    partial = {
        one: known
        for one in channels
        if one.time is None and one.reading.column
        for known in [np.isfinite(columns[one.reading.column])]
        if len(known) == len(stamps) and known.any() and not known.all()
    }
    others = [
        name
        for name in source.names
        if partial and name not in columns and meaning(name).quantity == "time"
    ]
    if not others or stamps.dtype.kind not in "iuf":
        return
    for name, raw in source.load(others).items():
        values = numbers(raw)
        for channel, known in partial.items():
            if not np.array_equal(np.isfinite(values), known):
                continue
            unit = UNITS.get(meaning(name).unit or "")
            passed = np.diff(values[known]) * (unit.factor if unit else time.count_s)
            of_log = np.diff(stamps[known]) * time.count_s
            # The same instants in another unit are no other clock.
            if (passed <= 0.0).any() or np.allclose(passed.sum(), of_log.sum(), rtol=0.01):
                continue
            seen = f"has values in just the rows of another clock, {name!r}"
            action = (
                f"read at the times of {time.column!r}; if the other is its clock, set"
                f" {channel.where}.time to it"
            )
            yield Finding(channel.target, seen, action)
