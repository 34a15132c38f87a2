"""A log with the columns that a map names: the runs of its clock, and its quantities."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import InputError, SettingsError
from pipelines.importing.finding import Finding, counted, noting, unnoted
from pipelines.importing.naming.meaning import TWIN, meaning
from pipelines.importing.naming.unit_in_name import clock_unit_in, unit_in
from pipelines.importing.quantities.conversion import columns_of, quantity
from pipelines.importing.quantities.labels import labels_in
from pipelines.importing.quantities.numbers import TAKEN_FOR_MISSING, numbers, same_stamps
from pipelines.importing.sources.source import Columns, Source
from pipelines.importing.time import clock
from pipelines.importing.time.clock import Run
from pipelines.settings import transmission
from pipelines.settings.import_map import ImportMap, ReadingSettings, TimeSettings
from pipelines.settings.units import ALIASES, UNITS
from pipelines.signals.sampling import between_samples, sample_rate
from pipelines.validation.suggestion import suggestion

Reading = TypeVar("Reading", bound=ReadingSettings)


@dataclass(frozen=True)
class Channel:
    """One column of the recording, and the reading that it comes from."""

    target: str
    where: str
    """Its place in the map."""
    reading: ReadingSettings
    gain: float
    required: bool
    enabled: str | None = None
    """Column that is 0 where the reading is not valid."""
    time: str | None = None
    """Column of its clock, if that is not the clock of the log."""
    turns: bool = False
    """Whether it is the angle of a joint that turns without end."""


@dataclass(frozen=True)
class Log:
    """The columns of a log, in memory, and its clock."""

    source: Source
    settings: TimeSettings
    channels: tuple[Channel, ...]
    columns: Columns
    labels: Columns
    """Columns that say of which machine a row is, or whether its values are good."""
    origin: float
    """The first stamp of the clock."""
    rows: int
    runs: tuple[Run, ...]
    findings: list[Finding]

    @property
    def required(self) -> list[str]:
        """The recording's columns that must have a value in every row."""
        return [channel.target for channel in self.channels if channel.required]

    @property
    def turns(self) -> dict[str, float]:
        """A turn of the counter in SI, for each of the recording's columns that has a counter."""
        turns = {}
        for one in self.channels:
            if one.reading.wraps_at is not None:
                gain = one.gain * one.reading.known_unit.factor * one.reading.scale
                turns[one.target] = abs(gain * one.reading.wraps_at)
        return turns

    def quantities(self, run: Run, findings: list[Finding]) -> Columns:
        """Return every channel at the instants of a run.

        Parameters
        ----------
        run : Run
            n instants.
        findings : list of Finding
            Extended by remarks on the channels.

        Returns
        -------
        Columns
            (n,) each, SI units; NaN where missing.
        """
        return {
            channel.target: self._where_enabled(channel, run, findings) for channel in self.channels
        }

    def _where_enabled(self, channel: Channel, run: Run, findings: list[Finding]) -> NDArray:
        values = self._quantity(channel, run, findings)
        if channel.enabled is None:
            return values
        switch = self.columns[channel.enabled]
        if len(switch) != self.rows:
            raise InputError(
                f"{channel.enabled!r} has {len(switch)} rows, expected {self.rows} as of the clock"
            )
        states = switch[run.rows]
        off, blank = states == 0.0, np.isnan(states)
        if (off | blank).all():
            problem = "has no number in any row" if blank.all() else "is on in no row"
            raise InputError(
                f"{channel.enabled!r} {problem}, expected 0 where the drive was off and another"
                " number where it was on; correct joint.enabled in the map, or leave it out"
            )
        for rows, state, cause in (
            (off, "is 0", "the drive was off"),
            (blank, "has no number", "the drive's state is not known"),
        ):
            if rows.any():
                count = counted(int(rows.sum()), "row")
                seen = f"{channel.enabled} {state} in {count}: {cause}"
                findings.append(Finding(channel.target, seen, TAKEN_FOR_MISSING))
        # Missing, not zero: such a row leaves the recording, while a torque of zero would enter the
        # fit.
        return np.where(off | blank, np.nan, values)

    def _quantity(self, channel: Channel, run: Run, findings: list[Finding]) -> NDArray:
        names = columns_of(channel.reading, channel.where)
        if channel.time is not None:
            return self._interpolated(channel, channel.time, run, findings)
        picked = {}
        for name in names:
            values = self.columns[name]
            # A constant has one row. Only an expression can use it; a channel needs a value a
            # stamp.
            if len(values) not in (1, self.rows) or (len(values) == 1 and channel.reading.column):
                raise InputError(
                    f"{name!r} has {len(values)} rows where the clock has {self.rows}; if it has a"
                    f" clock of its own, name that in the map: {channel.where}.time"
                )
            picked[name] = values if len(values) == 1 else values[run.rows]
        if all(len(self.columns[name]) == 1 for name in names):
            raise InputError(
                f"{channel.where}: {', '.join(names)} have one row each, expected one a stamp"
            )
        note = noting(channel.target, findings)
        return quantity(
            channel.reading,
            channel.gain,
            picked,
            channel.target,
            note,
            run.time_s,
            turns=channel.turns,
        )

    def _interpolated(
        self, channel: Channel, column: str, run: Run, findings: list[Finding]
    ) -> NDArray:
        """Return a channel with a clock of its own, interpolated linearly at a run's instants."""
        reading, of_time = channel.reading, noting("time", findings)
        own_clock = reading.clock(self.settings)
        where = f"{channel.where}.time: {column!r}"
        key = f"{channel.where}.time_unit"
        stamps = clock.stamps(self.columns[column], column, own_clock, of_time, key=key)
        columns = {name: self.columns[name] for name in columns_of(reading, channel.where)}
        if {len(values) for values in columns.values()} - {1, len(stamps)}:
            raise InputError(f"{channel.where} and its clock {column!r} differ in length")
        note = noting(channel.target, findings)
        if not np.isfinite(stamps).any():
            raise InputError(f"{where} has no time stamp in any row; correct the column")
        time_s = clock.seconds(stamps, clock.first_stamp(stamps), own_clock, unnoted)
        values = quantity(
            reading, channel.gain, columns, channel.target, note, time_s, turns=channel.turns
        )
        known = np.isfinite(values) & np.isfinite(stamps)
        if not known.any():
            return np.full(len(run), np.nan)
        stamps, first = stamps[known], stamps[known][0]
        since = clock.seconds(stamps, first, own_clock, of_time)
        own = clock.runs(since, stamps, own_clock.count_s, of_time)
        if not own:
            raise InputError(f"{where} has the same time stamp in every row; correct the column")
        # Runs of two clocks cannot be matched, as neither shows which of the other it belongs to.
        if len(own) > 1:
            raise InputError(f"{where} has {len(own)} runs, expected one; cut the file there")
        # Both clocks count from one origin, the first stamp of the log's own clock.
        ahead_s = self._ahead(first, own_clock) + reading.time_offset_s
        time, samples = own[0].time_s + own[0].began_s + ahead_s, values[known][own[0].rows]
        at = run.began_s + run.time_s
        if time[-1] < at[0] or time[0] > at[-1]:
            together_s = at[0] - time[0] + reading.time_offset_s
            cause = "correct its time_unit"
            if own_clock.is_written != self.settings.is_written:
                cause = "dates and plain numbers have no common origin"
            raise InputError(
                f"{where} runs from {time[0]:.6g} to {time[-1]:.6g} s, the log from {at[0]:.6g} to"
                f" {at[-1]:.6g} s; {cause}, or set its time_offset_s"
                f" ({together_s:.13g} if both began together)"
            )
        seen = f"sampled at {sample_rate(time):.4g} Hz by a clock of its own ({column})"
        note(seen, "interpolated linearly, not across its gaps")
        return between_samples(time, samples, at)

    def _ahead(self, first: float, own: TimeSettings) -> float:
        """Return the time from the first stamp of the log to the first of another clock, s."""
        # Whole stamps of one unit are subtracted as integers: float64 lacks their last digits.
        if own.count_s == self.settings.count_s:
            return float(first - self.origin) * own.count_s
        return float(first) * own.count_s - float(self.origin) * self.settings.count_s


def read_log(source: Source, settings: ImportMap, map_path: Path) -> Log:
    """Read the columns that a map names, and divide their clock into runs.

    Raises
    ------
    SettingsError
        If the map names columns that the log does not have, or has twice.
    """
    channels = tuple(_channels(settings, source))
    needed = _needed(channels, settings.time)
    for name, where in needed.items():
        # Asked first: a name that occurs twice is absent, because both columns have numbers.
        if f"{name}#1" in source.names:
            raise SettingsError(
                f"has {name!r} twice, which {where} in {map_path} names; name {name}#1, {name}#2"
                " ... in the map, or rename one in the file"
            )
        if source.column_named(name) not in source.names:
            # Names that were numbered for want of a header explain the most.
            reason = "; ".join(source.remarks) or _similar(name, source.names)
            raise SettingsError(
                f"has no column {name!r}, which {where} in {map_path} names; {reason}"
            )
    others = [name for name in labels_in(source.names) if name not in needed]
    columns, labels = _loaded(needed, source, others)
    findings = [Finding("rows", remark, "") for remark in source.remarks]
    findings += _scaling(channels, source)
    findings += _other_units(channels, source)
    findings += _units_above(channels, source)
    findings += _other_units_of_clocks(channels, columns, settings.time, source)
    note = noting("time", findings)
    if settings.time.column is None:
        # The longest, as constants have one row.
        rows, rate_hz = max(map(len, columns.values())), float(settings.time.rate_hz or 0.0)
        note("no clock in the log", f"rows taken for uniform at {rate_hz:g} Hz, by the map")
        run = Run(np.arange(rows), np.arange(rows) / rate_hz, 0.0)
        columns = _as_numbers(columns, set(), findings)
        return Log(source, settings.time, channels, columns, labels, 0.0, rows, (run,), findings)
    column = settings.time.column
    clocks = {channel.time for channel in channels} | {column, settings.time.plus}
    # A clock that is the same as that of the log is none of the channel's own.
    same = {
        one.time for one in channels if one.time and same_stamps(columns[one.time], columns[column])
    }
    # The map may name the clock of the log, to interpolate a channel of which rows are blank.
    channels = tuple(
        replace(one, time=None) if one.reading.time is None and one.time in same else one
        for one in channels
    )
    _check_switches(channels, source, {column, *same})
    columns = _as_numbers(columns, clocks, findings)
    findings += _clocks_in_the_same_rows(channels, columns, settings.time, source)
    plus = None if settings.time.plus is None else columns[settings.time.plus]
    stamps = clock.stamps(columns[column], column, settings.time, note, plus)
    origin = clock.first_stamp(stamps)
    time_s = clock.seconds(stamps, origin, settings.time, note)
    runs = tuple(clock.runs(time_s, stamps, settings.time.count_s, note))
    return Log(
        source, settings.time, channels, columns, labels, origin, len(stamps), runs, findings
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
    for name, values in _as_numbers(source.load(others), set(), []).items():
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


def _loaded(
    needed: Mapping[str, str], source: Source, others: Sequence[str]
) -> tuple[Columns, Columns]:
    """Return the columns by their names in the map, and other ones."""
    columns = {name: source.column_named(name) for name in needed}
    for column, times in Counter(columns.values()).items():
        if times > 1:
            names = [name for name, one in columns.items() if one == column]
            places = " and ".join(needed[name] for name in names)
            raise SettingsError(
                f"the columns {', '.join(names)} in the map are one, of {places}; correct one"
            )
    others = [name for name in others if name not in columns.values()]
    loaded = source.load([*columns.values(), *others])
    return (
        {name: loaded[column] for name, column in columns.items()},
        {name: loaded[name] for name in others},
    )


def _similar(name: str, names: Sequence[str]) -> str:
    """Suggest a column in the place of one that is missing."""
    # Within its own group, as other groups may have columns of nearly the same name.
    group = name.rpartition(".")[0] + "."
    siblings = [sibling for sibling in names if sibling.startswith(group)]
    return suggestion(name, siblings or list(names))


def _channels(settings: ImportMap, source: Source) -> Iterator[Channel]:
    for i, joint in enumerate(settings.joint):
        for name, reading in joint.readings():
            gain = reading.gain(transmission.dimension_at(joint.kind, name))
            time = _clock(reading, f"joint[{i}].{name}", settings, source)
            yield Channel(
                joint.joint.column(name),
                f"joint[{i}].{name}",
                _with_clock(reading, time, settings),
                gain,
                # The equation of motion needs both; other channels may be blank in some rows.
                required=name in ("angle", "torque"),
                # While a drive is off only its torque is no measurement; the encoder still is one.
                enabled=joint.enabled if name == "torque" else None,
                time=time,
                turns=joint.turns and name in ("angle", "reference"),
            )
    for i, force in enumerate(settings.force):
        where = f"force[{i}]"
        clock_of = _clock(force, where, settings, source)
        force = _with_clock(force, clock_of, settings)
        yield Channel(force.target, where, force, 1.0, required=False, time=clock_of)


def _with_clock(reading: Reading, time: str | None, settings: ImportMap) -> Reading:
    """Return a reading with the unit and offset of its clock.

    The map may have them at another channel of that clock.
    """
    keys = ("time_unit", "time_scale", "time_offset_s")
    of_clock = (one for _, one in settings.readings() if one.time is not None and one.time == time)
    other = next((one for one in of_clock if one.model_fields_set & set(keys)), None)
    if other is None or reading.model_fields_set & set(keys):
        return reading
    return reading.model_copy(update={key: getattr(other, key) for key in keys})


def _clock(reading: ReadingSettings, where: str, settings: ImportMap, source: Source) -> str | None:
    """Return the clock of a reading: of the map, or else of the file, if it is not the log's."""
    if reading.time is not None or settings.time.column is None:
        return reading.time
    columns = (source.column_named(name) for name in columns_of(reading, where))
    own = {source.clocks.get(name) for name in columns} - {None}
    if len(own) > 1:
        names = ", ".join(sorted(map(str, own)))
        raise SettingsError(f"{where}.expression: mixes columns of the clocks {names}; use one")
    return next(iter(own - {settings.time.column}), None)


def _check_switches(channels: Sequence[Channel], source: Source, same: set[str]) -> None:
    """Refuse a switch that was sampled by another clock: its rows are not those of the log."""
    for channel in channels:
        of_switch = source.clocks.get(str(channel.enabled))
        if of_switch is not None and of_switch not in same:
            raise InputError(
                f"{channel.enabled!r} has a clock of its own, {of_switch!r}; joint.enabled needs"
                " a column with the clock of the log"
            )


def _needed(channels: tuple[Channel, ...], time: TimeSettings) -> dict[str, str]:
    """Return every column that the map names, and its first place there."""
    needed = {time.column: "time.column"} if time.column is not None else {}
    if time.plus is not None:
        needed.setdefault(time.plus, "time.plus")
    for channel in channels:
        for name in columns_of(channel.reading, channel.where):
            needed.setdefault(name, channel.where)
        if channel.time is not None:
            needed.setdefault(channel.time, f"{channel.where}.time")
        if channel.enabled is not None:
            needed.setdefault(channel.enabled, f"{channel.where.rpartition('.')[0]}.enabled")
    return needed


def _as_numbers(columns: Columns, clocks: set[str | None], findings: list[Finding]) -> Columns:
    """Return the columns as float64, but clocks as they are: dates, or integers of many digits."""
    return {
        name: values if name in clocks else numbers(values, noting(name, findings))
        for name, values in columns.items()
    }
