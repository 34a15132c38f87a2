"""A log's clock: converted to seconds, divided where it starts over, and sorted."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from pipelines.errors import InputError, SettingsError
from pipelines.importing.finding import Finding, Note, counted, noting, unnoted
from pipelines.importing.quantities.numbers import frames_in_a_second, numbers, whole_nanoseconds
from pipelines.settings.import_map import TimeSettings
from pipelines.settings.units import UNITS, unit_named
from pipelines.signals.sampling import local_period, missing_samples, sample_rate, uneven_share

REGISTERS = (2.0**16, 2.0**31, 2.0**32)
"""Moduli of counters."""
LONGEST = 29
"""Greatest length of a stamp in a message: a date to the nanosecond."""
NANOSECOND = 1e-9
"""Count of dates, s."""
DAY_NS = 86_400_000_000_000
"""A day, ns."""
HOUR_S = 3600.0
"""An hour, s."""
SET_BACK = {
    1.0: "as at the end of summer time",
    12.0: "as a 12-hour clock without AM and PM",
}
"""Hours by which written clocks go back without a pause, and the likely cause."""
NEAR = 0.01
"""Distance from its modulus, as a share, within which a counter is full."""
SLOWEST_HZ, FASTEST_HZ = 10.0, 1e4
"""Usual rates of machines: three decades, so that only one of s, ms, us and ns fits."""


@dataclass(frozen=True)
class Run:
    """Rows over which the clock goes forward, in the order of time."""

    rows: NDArray
    """(n,) row numbers in the file."""
    time_s: NDArray
    """(n,) times since the run's first row, s; strictly increasing."""
    began_s: float
    """Time of its first row since the file's first stamp, s."""
    findings: tuple[Finding, ...] = ()
    """About this run alone."""

    def __len__(self) -> int:
        return len(self.rows)


def usual_units(step: float, units: Sequence[str] = ("s", "ms", "us", "ns")) -> list[str]:
    """Return the units in which a step gives a usual rate of machines.

    Parameters
    ----------
    step : float
        From one stamp to the next, in the unknown unit.
    units : sequence of str
        Units that are tried.
    """
    rates_hz = {unit: 1.0 / (step * UNITS[unit].factor) for unit in units}
    return [unit for unit, rate_hz in rates_hz.items() if SLOWEST_HZ <= rate_hz <= FASTEST_HZ]


def _check_unit(raw: NDArray, column: str, unit: str, key: str) -> None:
    """Refuse dates with the unit of numbers, and numbers with the unit of dates."""
    content = _content(raw)
    fits = {
        "dates": unit == "iso8601",
        "durations": False,
        "plain numbers": unit != "iso8601",
        "": True,
    }[content]
    # Typed dates and durations in a file are whole nanoseconds, too.
    if fits or (raw.dtype.kind in "mM" and unit == "ns"):
        return
    known = raw[~pd.isna(raw)]
    right = {"dates": ["iso8601"], "durations": ["ns"]}.get(content)
    if right is None:
        right = usual_units(period(numbers(known))) or ["s", "ms", "us", "ns"]
    raise SettingsError(
        f"{column!r} holds {content}, the first {str(known[0])[:LONGEST]!r}, but the map has"
        f" {key} = {unit!r}; set it to {' or '.join(right)}"
    )


def _content(raw: NDArray) -> str:
    """Return the kind of stamps (n,): dates, durations or plain numbers; empty where unknown."""
    # Stamps from which the content of a text column is derived.
    few = 100
    if raw.dtype.kind in "biufmM":
        return {"M": "dates", "m": "durations"}.get(raw.dtype.kind, "plain numbers")
    some = raw[~pd.isna(raw)][:few]
    if np.isfinite(numbers(some)).any():
        return "plain numbers"
    return "dates" if np.isfinite(whole_nanoseconds(some)).any() else ""


def stamps(
    raw: NDArray,
    column: str,
    settings: TimeSettings,
    note: Note,
    plus: NDArray | None = None,
    key: str = "time.unit",
) -> NDArray:
    """Return time stamps as numbers of counts (``TimeSettings.count_s``).

    Whole numbers stay integers, as float64 cannot represent every nanosecond since 1970.

    Parameters
    ----------
    raw : (n,) array
        Stamps as the file has them.
    column : str
        Name of their column, for messages.
    settings : TimeSettings
        Unit of the stamps.
    note : callable
        Takes what is reported about the stamps.
    plus : (n,) array, optional
        The column that is added.
    key : str
        Key of the map with the unit, for messages.

    Returns
    -------
    (n,) array
        int64, or float64 with NaN where a stamp is missing.

    Raises
    ------
    SettingsError
        If they are dates and the unit is one of numbers, or the other way round.
    InputError
        If there is no date, or a stamp does not fit into int64.
    """
    if plus is not None and len(plus) != len(raw):
        raise InputError(f"time.plus has {len(plus)} rows, expected {len(raw)} as {column!r}")
    if settings.is_written:
        return _written(raw, column, settings, note, plus, key)
    _check_unit(raw, column, settings.unit, key)
    values = _counts(raw, note)
    if plus is None:
        return values
    unit = unit_named(settings.unit)
    assert unit is not None, "the map checks its units"
    ratio = unit.factor * settings.scale / settings.count_s
    # As integers where possible: seconds since 1970 and their nanoseconds need all digits. Of a
    # column finer than `plus` no whole number of counts makes one of `plus`.
    is_whole = values.dtype.kind == "i" and abs(round(ratio) - ratio) <= 1e-9 * ratio
    return values * (round(ratio) if is_whole else ratio) + _counts(plus, note)


def _counts(raw: NDArray, note: Note) -> NDArray:
    values = whole_nanoseconds(raw) if raw.dtype.kind in "mM" else raw
    return whole(values) if values.dtype.kind in "iu" else numbers(values, note)


def _written(
    raw: NDArray, column: str, settings: TimeSettings, note: Note, plus: NDArray | None, key: str
) -> NDArray:
    """Return dates and times of day as nanoseconds."""
    # A number without a unit, such as 120000, is a time of day written without colons.
    is_fraction = "plus_unit" in settings.model_fields_set
    if plus is not None and not is_fraction:
        # A file's typed date ends with a time of its own.
        days = raw.astype("datetime64[D]") if raw.dtype.kind == "M" else raw
        raw = np.array([f"{day} {time}" for day, time in zip(days, plus, strict=True)], object)
    if settings.format is None:
        _check_unit(raw, column, settings.unit, key)
    frames = frames_in_a_second(raw)
    if frames is not None:
        raise InputError(
            f"{column!r} has a time code: its last digits count {frames} frames in each second."
            " Where rows are uniform, set time.rate_hz in place of time.column"
        )
    values = whole_nanoseconds(raw, settings.format)
    if len(raw) and not np.isfinite(values).any():
        example = " such as 2026-01-31 12:00:00.125" if settings.format is None else ""
        day = (
            "; where day and month may be exchanged, set time.format"
            if example and "/" in str(raw[0])
            else ""
        )
        raise InputError(
            f"has {str(raw[0])[:LONGEST]!r}, expected a date{example or ' as in time.format'};"
            f" correct {'time.column or time.unit' if example else 'time.format'} in the map{day}"
            f"{'; if time.plus holds numbers, set time.plus_unit' if plus is not None else ''}"
        )
    stamps = whole(values) if values.dtype.kind in "iu" else values
    if plus is not None and is_fraction:
        unit = unit_named(settings.plus_unit)
        assert unit is not None, "the map checks its units"
        stamps = stamps + _counts(plus, note) * round(unit.factor / NANOSECOND)
    return _past_midnight(stamps, note)


def _past_midnight(stamps: NDArray, note: Note) -> NDArray:
    """Count times of day (n,) without a date on after midnight, ns."""
    known = stamps[np.isfinite(stamps)]
    if not len(known) or known.min() < 0 or known.max() >= DAY_NS:
        return stamps
    far = 20 * period(known)
    # A clock that starts over goes back by less than a day, but for a moment.
    steps = np.diff(known, prepend=known[0])
    nights = (steps < 0) & (steps + DAY_NS <= max(far, 1e9))
    if nights.any():
        note(f"passes midnight, {counted(int(nights.sum()), 'time')}", "counted on")
        stamps = stamps.copy()
        stamps[np.isfinite(stamps)] = known + (DAY_NS * np.cumsum(nights)).astype(stamps.dtype)
    return stamps


def whole(values: NDArray) -> NDArray:
    """Return whole stamps as int64, in which differences do not wrap around.

    Parameters
    ----------
    values : (n,) array of integers
        Stamps of any width, with or without sign.

    Returns
    -------
    (n,) array of int64
        The same stamps.

    Raises
    ------
    InputError
        If a stamp does not fit.
    """
    if values.dtype.kind == "u" and len(values) and values.max() > np.iinfo(np.int64).max:
        raise InputError(
            f"has the time stamp {values.max()}, too large for a clock; correct time.column in the"
            " map, or mark missing stamps as such"
        )
    return values.astype(np.int64)


def seconds(values: NDArray, origin: float, settings: TimeSettings, note: Note) -> NDArray:
    """Return stamps as times since an origin.

    Parameters
    ----------
    values : (n,) array
        Stamps in counts.
    origin : float
        Stamp at time 0.
    settings : TimeSettings
        Duration of a count, and the modulus of the clock if it wraps around.
    note : callable
        Takes what is reported about wraparounds.

    Returns
    -------
    (n,) array
        Times, s, NaN where a stamp is missing.
    """
    # Subtracted as integers first, because float64 cannot hold every nanosecond since 1970.
    since = (values - origin).astype(float)
    if settings.wraps_at is not None:
        since = _unwrapped(since, settings.wraps_at, note)
    return since * settings.count_s


def first_stamp(values: NDArray) -> float:
    """Return the first of the stamps (n,) that is not missing.

    Raises
    ------
    InputError
        If all are missing.
    """
    known = values if values.dtype.kind in "iu" else values[np.isfinite(values)]
    if not len(known):
        raise InputError("no row has a time stamp; correct time.column or time.unit in the map")
    return known[0]


def _unwrapped(since: NDArray, modulus: float, note: Note) -> NDArray:
    """Undo wraparounds, which are steps back by more than half the modulus."""
    known = np.isfinite(since)
    wraps = np.diff(since[known], prepend=since[known][0]) < -0.5 * modulus
    if wraps.any():
        note(f"wraps at {modulus:.10g}, {counted(int(wraps.sum()), 'time')}", "counted on")
        since[known] += modulus * np.cumsum(wraps)
    return since


def runs(time_s: NDArray, raw: NDArray, count_s: float, note: Note = unnoted) -> list[Run]:
    """Divide a log into runs whose times strictly increase; refuse a clock that runs backwards.

    Parameters
    ----------
    time_s : (n,) array
        Times, s, which may be missing, repeat, go back and start over.
    raw : (n,) array
        Stamps as the file has them, which show whether a counter was full.
    count_s : float
        Duration of a count of these stamps, s.
    note : callable
        Takes what is reported about the clock.

    Returns
    -------
    list of Run
        Runs of at least two rows, in the order of the file.
    """
    rows = np.flatnonzero(np.isfinite(time_s))
    if len(rows) < len(time_s):
        note(f"{counted(len(time_s) - len(rows), 'row')} without a stamp", "left out")
    time = time_s[rows]
    if runs_backwards(time):
        raise InputError(
            f"its clock runs backwards, by {time[0] - time[-1]:.6g} s from the first row to the"
            " last; reverse the order of its rows, or correct time.column in the map"
        )
    # Outliers first: one stamp far ahead would look like a clock that starts over after it.
    rows = _without_outliers(rows, time_s, note)
    begins = _begins(time_s[rows])
    _check_fractions(raw[rows], begins[1:])
    _note_restarts(rows, begins[1:], time_s, raw, count_s, note)
    parts = [_ordered(part, time_s) for part in np.split(rows, begins[1:])]
    return [run for run in parts if len(run) > 1]


def _check_fractions(stamps: NDArray, restarts: Sequence[int]) -> None:
    """Refuse a clock that goes back within its second, in one second after the other.

    Seconds and microseconds that were put together without leading zeros do so: 5 ms after 12 s
    become 12.5000. Runs that are shorter than a minute or a day, in these units, start over within
    the first one only.
    """
    # In a second or two a clock may be set back by chance.
    by_chance = 2
    whole = np.floor(stamps.astype(float))
    at = np.asarray(restarts, dtype=int)
    in_seconds = len(np.unique(whole[at]))
    stays = np.all(whole[at] == whole[at - 1]) and np.all(np.diff(whole) >= 0.0)
    if in_seconds > by_chance and stays:
        raise InputError(
            f"its clock goes back {len(at)} times, but its whole part never does: fractions are"
            " written without their leading zeros. Correct the stamps, or set time.rate_hz in place"
            " of time.column where rows are uniform"
        )


def runs_backwards(time: NDArray) -> bool:
    """Return whether a clock goes back at nine steps of ten.

    Parameters
    ----------
    time : (n,) array
        Stamps in any unit.
    """
    # Share of steps back from which a clock runs backwards.
    backwards = 0.9
    steps = np.diff(time)
    return bool(len(steps)) and bool(np.mean(steps < 0.0) > backwards)


def period(time: NDArray) -> float:
    """Return the median step forward of times (n,), in their unit; infinite without one."""
    steps = np.diff(time)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if len(steps) else np.inf


def _far(time: NDArray) -> float:
    """Return the step, s, back by more than which a clock starts over: 1 s, or 20 periods."""
    return max(1.0, 20 * period(time))


def _without_outliers(rows: NDArray, time_s: NDArray, note: Note) -> NDArray:
    """Leave out single stamps far from both neighbours, which are close to each other."""
    time = time_s[rows]
    far, step = _far(time), np.diff(time)
    stray = (
        (np.abs(step[:-1]) > far) & (np.abs(step[1:]) > far) & (np.abs(time[2:] - time[:-2]) < far)
    )
    if stray.any():
        first = rows[int(np.argmax(stray)) + 1]
        seen = (
            f"{counted(int(stray.sum()), 'stamp')} far from both neighbours, the first in row"
            f" {first}"
        )
        note(seen, "left out")
    return rows[np.concatenate([[True], ~stray, [True]])] if len(rows) > 2 else rows


def _begins(time: NDArray) -> list[int]:
    """Return the first row, and each row at which the clock starts over."""
    # Two kinds of restart: a step far back, then, between those, a small one that lasts.
    cuts = [0, *(np.flatnonzero(np.diff(time) < -_far(time)) + 1), len(time)]
    begins = []
    for first, last in pairwise(cuts):
        begins.append(int(first))
        behind = _stays_behind(time[first:last])
        while behind is not None:
            begins.append(begins[-1] + behind)
            behind = _stays_behind(time[begins[-1] : last])
    return begins


def _stays_behind(time: NDArray) -> int | None:
    """Return the row from which time stays behind its maximum for many rows, if any."""
    # A clock that stays behind its latest stamp for more rows than these starts over, too.
    restart_rows = 20
    late = time < np.maximum.accumulate(time)
    edges = np.flatnonzero(np.diff(late, prepend=False, append=False))
    starts, ends = edges[::2], edges[1::2]
    long = np.flatnonzero(ends - starts > restart_rows)
    return int(starts[long[0]]) if len(long) else None


def full_clock(before: float, after: float, step: float, count_s: float) -> float | None:
    """Return the modulus of a clock that goes back from one stamp to the next.

    Parameters
    ----------
    before, after : float
        Both stamps, in counts.
    step : float
        Usual step, in counts.
    count_s : float
        Duration of a count, s.

    Returns
    -------
    float or None
        Counts; None where neither a register's width fits nor whole hours.
    """
    near = [limit for limit in REGISTERS if (1.0 - NEAR) * limit < before < limit]
    # A counter with a sign continues at its lowest number, below zero.
    moduli = [2.0 * near[0] if after < 0.0 else near[0]] if near else []
    # A clock of the day begins again at midnight, without a pause; others after 1, 10 or 12 hours.
    hours = np.round(before * count_s / HOUR_S)
    whole_hours = _in_counts(hours * HOUR_S, count_s)
    if hours >= 1.0 and 0.0 < after + whole_hours - before <= 20.0 * step:
        moduli.append(whole_hours)
    return moduli[0] if moduli else None


def _set_back(back_s: float, step_s: float) -> float | None:
    """Return the whole hours by which a clock was set back without a pause, if any."""
    fits = (hours for hours in SET_BACK if 0.0 < hours * HOUR_S - back_s <= 20.0 * step_s)
    return next(fits, None)


def is_usual_modulus(modulus: float, count_s: float) -> bool:
    """Return whether a clock wraps around as registers or clocks of the day do.

    Parameters
    ----------
    modulus : float
        Reading at which it wraps around, in counts.
    count_s : float
        Duration of a count, s.
    """
    day = _in_counts(1e-9 * DAY_NS, count_s)
    return modulus in (*REGISTERS, *(2.0 * one for one in REGISTERS), day)


def _in_counts(seconds: float, count_s: float) -> float:
    """Return a time in counts, as a person writes it: rounding in float64 is left out."""
    return float(f"{seconds / count_s:.12g}")


def _note_restarts(
    rows: NDArray,
    begins: Sequence[int],
    time_s: NDArray,
    raw: NDArray,
    count_s: float,
    note: Note,
) -> None:
    """Report where a clock starts over: of times with one remedy, how many and the first."""
    step = period(time_s[rows]) / count_s
    by_modulus: dict[float | None, list[int]] = {}
    for k in begins:
        full = full_clock(float(raw[rows[k - 1]]), float(raw[rows[k]]), step, count_s)
        by_modulus.setdefault(full, []).append(k)
    for full, places in by_modulus.items():
        first = places[0]
        back = time_s[rows[first - 1]] - time_s[rows[first]]
        times = "" if len(places) == 1 else f" {len(places)} times, the first"
        action = "another run begins" if len(places) == 1 else "each time another run begins"
        if full is not None:
            before = float(raw[rows[first - 1]])
            action = f"after {before:.10g}: if it was full, set time.wraps_at = {full:.14g}"
        elif (hours := _set_back(back, step * count_s)) is not None:
            modulus = _in_counts(hours * HOUR_S, count_s)
            action = f"{SET_BACK[hours]}: if that is so, set time.wraps_at = {modulus:.14g}"
        note(f"clock starts over{times} at row {rows[first]}, {back:.6g} s back", action)


def _ordered(rows: NDArray, time_s: NDArray) -> Run:
    """Return rows in the order of time, one for each stamp, without a few long before the rest."""
    findings: list[Finding] = []
    note = noting("time", findings)
    time = time_s[rows]
    back = np.count_nonzero(np.diff(time) < 0.0)
    if back:
        # Stable, so that of rows with one stamp the first in the file stays the first.
        order = np.argsort(time, kind="stable")
        rows, time = rows[order], time[order]
        note(f"goes back a little, {counted(int(back), 'time')}", "rows put in order")
    repeated = np.diff(time, prepend=-np.inf) <= 0.0
    if repeated.any():
        count, share = int(repeated.sum()), float(repeated.mean())
        seen = f"{counted(count, 'row')} ({share:.1%}) with the stamp of another, the first is row"
        advice = ""
        if share >= 0.05:
            advice = "; if rows are uniform and the clock is coarse, set time.rate_hz instead"
        note(f"{seen} {rows[np.argmax(repeated)]}", f"the first of each kept{advice}")
        rows, time = rows[~repeated], time[~repeated]
    first = _lead(time)
    if first:
        seen = f"{counted(first, 'row')} {time[first] - time[first - 1]:.3g} s before the rest"
        note(seen, "left out")
    return Run(rows[first:], time[first:] - time[first], float(time[first]), tuple(findings))


def _lead(time: NDArray) -> int:
    """Return the number of rows at the beginning that are long before the rest."""
    # At most 5 rows: more of them are a run of their own. Long before is 0.2 s and 20 periods.
    steps = np.diff(time[:6])
    far = np.flatnonzero(steps > max(0.2, 20 * period(time)))
    return int(far[-1]) + 1 if len(far) else 0


@dataclass(frozen=True)
class Sampling:
    """How regularly a run was sampled."""

    rate_hz: float
    gaps: Sequence[tuple[float, int]]
    """First missing time (s) and how many samples are missing."""
    longest_gap_s: float
    """Time without samples in the longest gap, beyond a usual step."""
    steps_s: tuple[float, float, float]
    """Shortest, median and longest step, without gaps."""
    irregular: float
    """Share of the steps that are more than 2 % off the median."""
    rates_hz: tuple[float, float]
    """Lowest and highest rate that lasts for a tenth of the run or more."""

    @classmethod
    def of(cls, time_s: NDArray) -> "Sampling":
        """Measure rate, gaps and regularity.

        Parameters
        ----------
        time_s : (n,) array
            Times of the samples, s.
        """
        steps, missing = np.diff(time_s), missing_samples(time_s)
        regular = steps[missing == 0]
        period = local_period(time_s)
        gaps = [(float(time_s[k] + period[k]), int(missing[k])) for k in np.flatnonzero(missing)]
        limits = (float(regular.min()), float(np.median(regular)), float(regular.max()))
        # Means, as steps that merely vary have medians that do so too.
        lasting = uniform_filter1d(regular, max(1, len(regular) // 20), mode="mirror")
        slow, fast = np.quantile(lasting, (0.9, 0.1))
        rates_hz = (float(1.0 / slow), float(1.0 / fast))
        longest_gap_s = float(np.max((steps - period)[missing > 0], initial=0.0))
        return cls(
            sample_rate(time_s), gaps, longest_gap_s, limits, uneven_share(regular), rates_hz
        )

    @property
    def missing(self) -> int:
        """Samples missing in all gaps."""
        return sum(count for _, count in self.gaps)
