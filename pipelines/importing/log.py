"""A log with the columns that a map names: the runs of its clock, and its quantities."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import InputError, SettingsError
from pipelines.importing.channel import Channel, channels_of, needed_columns
from pipelines.importing.file_against_map import contradictions
from pipelines.importing.finding import Finding, counted, noting, unnoted
from pipelines.importing.quantities.conversion import columns_of, quantity
from pipelines.importing.quantities.labels import labels_in
from pipelines.importing.quantities.numbers import TAKEN_FOR_MISSING, numbers, same_stamps
from pipelines.importing.sources.source import Columns, Source
from pipelines.importing.time import clock
from pipelines.importing.time.clock import Run
from pipelines.settings.import_map import ImportMap, TimeSettings
from pipelines.signals.sampling import between_samples, sample_rate
from pipelines.validation.suggestion import suggestion


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
    channels, time = tuple(channels_of(settings, source)), settings.time
    needed = needed_columns(channels, time)
    _refuse_absent(needed, source, map_path)
    others = [name for name in labels_in(source.names) if name not in needed]
    columns, labels = _loaded(needed, source, others)
    findings = [Finding("rows", remark, "") for remark in source.remarks]
    note = noting("time", findings)
    if time.column is None:
        # The longest, as constants have one row.
        rows, rate_hz = max(map(len, columns.values())), float(time.rate_hz or 0.0)
        note("no clock in the log", f"rows taken for uniform at {rate_hz:g} Hz, by the map")
        run = Run(np.arange(rows), np.arange(rows) / rate_hz, 0.0)
        columns = _as_numbers(columns, set(), findings)
        findings += contradictions(channels, columns, time, source)
        return Log(source, time, channels, columns, labels, 0.0, rows, (run,), findings)
    column = time.column
    clocks = {channel.time for channel in channels} | {column, time.plus}
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
    findings += contradictions(channels, columns, time, source)
    plus = None if time.plus is None else columns[time.plus]
    stamps = clock.stamps(columns[column], column, time, note, plus)
    origin = clock.first_stamp(stamps)
    runs = tuple(clock.runs(clock.seconds(stamps, origin, time, note), stamps, time.count_s, note))
    return Log(source, time, channels, columns, labels, origin, len(stamps), runs, findings)


def _refuse_absent(needed: Mapping[str, str], source: Source, map_path: Path) -> None:
    """Refuse a map that names a column which the log does not have, or has twice."""
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


def _check_switches(channels: Sequence[Channel], source: Source, same: set[str]) -> None:
    """Refuse a switch that was sampled by another clock: its rows are not those of the log."""
    for channel in channels:
        of_switch = source.clocks.get(str(channel.enabled))
        if of_switch is not None and of_switch not in same:
            raise InputError(
                f"{channel.enabled!r} has a clock of its own, {of_switch!r}; joint.enabled needs"
                " a column with the clock of the log"
            )


def _as_numbers(columns: Columns, clocks: set[str | None], findings: list[Finding]) -> Columns:
    """Return the columns as float64, but clocks as they are: dates, or integers of many digits."""
    return {
        name: values if name in clocks else numbers(values, noting(name, findings))
        for name, values in columns.items()
    }
