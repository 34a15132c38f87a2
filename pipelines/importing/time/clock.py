"""A log's clock: brought to seconds, cut where it starts over, put in order, and told of."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.errors import InputError, SettingsError
from pipelines.importing.finding import Finding, counted
from pipelines.importing.quantities.numbers import numbers, whole_nanoseconds
from pipelines.settings.import_map import TimeSettings
from pipelines.settings.units import UNITS, unit_named

RESTART_S, RESTART_PERIODS, RESTART_ROWS = 1.0, 20, 20
"""A clock that steps back by more than the longer of the first two starts over, and one that stays
behind for more rows than the third; a smaller step is of rows that arrived out of order."""
LEAD_ROWS, LEAD_PERIODS, LEAD_S = 5, 20, 0.2
"""So few rows, so long before the rest, are no part of the run."""
REGISTERS = (2.0**16, 2.0**31, 2.0**32)
"""Where counters are full."""
FEW = 100
"""Stamps by which a column of text is known for one of dates."""
LONGEST = 29
"""Letters of a stamp that are shown: a date to the nanosecond."""
NEAR = 0.01
BACKWARDS = 0.9
SLOWEST_HZ, FASTEST_HZ = 10.0, 1e4
"""Between these a machine is sampled; three decades, so that of s, ms, us and ns only one fits."""


@dataclass(frozen=True)
class Run:
    """Rows over which the clock went on, in the order of time."""

    rows: NDArray
    """(n,) their numbers in the file."""
    time_s: NDArray
    """(n,) strictly increasing; 0 where the run begins."""
    began_s: float
    """Time of its first row since the file's first stamp."""
    findings: tuple[Finding, ...] = ()
    """About this run alone."""

    def __len__(self) -> int:
        return len(self.rows)


def usual_units(step: float) -> list[str]:
    """Return the units in which a step from one stamp to the next makes a rate that machines are
    sampled at."""
    return [
        unit
        for unit in ("s", "ms", "us", "ns")
        if SLOWEST_HZ <= 1.0 / (step * UNITS[unit].factor) <= FASTEST_HZ
    ]


def refuse_another_unit(raw: NDArray, column: str, unit: str) -> None:
    """Refuse dates (n,) whose unit is one of numbers, and numbers whose unit is that of dates.

    Raises
    ------
    SettingsError
        Where that is so, with the unit to set.
    """
    holds = _held(raw)
    # Dates and durations that a file tells as such are whole nanoseconds too.
    fits = {
        "dates": unit == "iso8601",
        "durations": False,
        "plain numbers": unit != "iso8601",
        "": True,
    }[holds]
    if fits or (raw.dtype.kind in "mM" and unit == "ns"):
        return
    known = raw[~pd.isna(raw)]
    right = {"dates": ["iso8601"], "durations": ["ns"]}.get(holds) or _usual(
        numbers(known, column, [])
    )
    raise SettingsError(
        f"{column!r} holds {holds}, the first {str(known[0])[:LONGEST]!r}, and time.unit = {unit!r}"
        f" in the map says otherwise; set it to {' or '.join(right)}"
    )


def _usual(known: NDArray) -> list[str]:
    """Return the units in which stamps (n,) that are numbers make a usual rate; all of them where
    in none."""
    steps = np.diff(known)
    steps = steps[steps > 0.0]
    return (usual_units(float(np.median(steps))) if len(steps) else []) or ["s", "ms", "us", "ns"]


def _held(raw: NDArray) -> str:
    """Return what a column (n,) of stamps holds: dates, durations or plain numbers; nothing where
    it does not say."""
    if raw.dtype.kind in "biufmM":
        return {"M": "dates", "m": "durations"}.get(raw.dtype.kind, "plain numbers")
    some = raw[~pd.isna(raw)][:FEW]
    if np.isfinite(numbers(some, "", [])).any():
        return "plain numbers"
    return "dates" if np.isfinite(whole_nanoseconds(some)).any() else ""


def stamps(raw: NDArray, settings: TimeSettings, findings: list[Finding]) -> NDArray:
    """Return time stamps (n,) as numbers in the map's unit; whole numbers stay whole, for
    nanoseconds since 1970 are more than a float64 can tell apart.

    Raises
    ------
    InputError
        Where whole numbers are larger than any clock counts.
    """
    found = whole_nanoseconds(raw) if settings.unit == "iso8601" or raw.dtype.kind in "mM" else raw
    if settings.unit == "iso8601" and len(raw) and not np.isfinite(found).any():
        raise InputError(
            f"has {str(raw[0])[:LONGEST]!r} where a date should be, expected dates as 2026-01-31"
            " 12:00:00.125; write them so, or correct time.column or time.unit in the map"
        )
    return whole(found) if found.dtype.kind in "iu" else numbers(found, "time", findings)


def whole(found: NDArray) -> NDArray:
    """Return whole stamps (n,) as int64: of narrower numbers, and of those without a sign, a
    difference wraps round.

    Raises
    ------
    InputError
        Where they are larger than that holds.
    """
    if found.dtype.kind == "u" and len(found) and found.max() > np.iinfo(np.int64).max:
        raise InputError(
            f"has the time stamp {found.max()}, more than any clock counts; correct time.column in"
            " the map, or mark stamps that are missing as such"
        )
    return found.astype(np.int64)


def seconds(
    found: NDArray, origin: float, settings: TimeSettings, findings: list[Finding]
) -> NDArray:
    """Return stamps (n,) as seconds since ``origin``, which is a stamp too; NaN where there is
    none."""
    unit = unit_named(settings.unit)
    assert unit is not None, "was looked at with the map"
    since = (found - origin).astype(float)
    if settings.wraps_at is not None:
        since = _counted_on(since, settings.wraps_at, findings)
    return since * unit.factor


def first_stamp(found: NDArray) -> float:
    """Return the first of the stamps (n,) that is one, as it stands in the file.

    Raises
    ------
    InputError
        Where none is.
    """
    known = found if found.dtype.kind in "iu" else found[np.isfinite(found)]
    if not len(known):
        raise InputError("no row has a time stamp; correct time.column or time.unit in the map")
    return known[0]


def _counted_on(since: NDArray, modulus: float, findings: list[Finding]) -> NDArray:
    """Undo wraps: a clock that steps back by more than half of where it is full has gone on in
    truth."""
    known = np.isfinite(since)
    wraps = np.diff(since[known], prepend=since[known][0]) < -0.5 * modulus
    if wraps.any():
        findings.append(
            Finding(
                "time",
                f"wraps at {modulus:.10g}, {counted(int(wraps.sum()), 'time')}",
                "counted on",
            )
        )
        since[known] += modulus * np.cumsum(wraps)
    return since


def uniform(rows: int, rate_hz: float, findings: list[Finding]) -> Run:
    """Return the run of a log without a clock, whose rows are known to come at a rate."""
    findings.append(
        Finding(
            "time",
            "no clock in the log",
            f"rows taken for uniform at {rate_hz:g} Hz, as the map says",
        )
    )
    return Run(np.arange(rows), np.arange(rows) / rate_hz, 0.0)


def runs(time_s: NDArray, raw: NDArray, findings: list[Finding]) -> list[Run]:
    """Return the runs of a log whose stamps (n,) may repeat, go back and start over; each strictly
    increases.

    ``raw`` are the stamps as they stand in the file, to tell a clock that was full.
    """
    rows = np.flatnonzero(np.isfinite(time_s))
    if len(rows) < len(time_s):
        findings.append(
            Finding(
                "time", f"{counted(len(time_s) - len(rows), 'row')} without a stamp", "left out"
            )
        )
    _refuse_backwards(time_s[rows])
    rows = _without_strays(rows, time_s, findings)
    begins = _begins(time_s[rows])
    for k in begins[1:]:
        back = time_s[rows[k - 1]] - time_s[rows[k]]
        seen = f"clock starts over at row {rows[k]}, {back:.6g} s back"
        findings.append(
            Finding("time", seen, _if_full(float(raw[rows[k - 1]]), float(raw[rows[k]])))
        )
    found = [_ordered(part, time_s) for part in np.split(rows, begins[1:])]
    return [run for run in found if len(run) > 1]


def runs_backwards(time: NDArray) -> bool:
    """Tell whether a clock (n,) goes back at nine steps of ten."""
    steps = np.diff(time)
    return bool(len(steps)) and bool(np.mean(steps < 0.0) > BACKWARDS)


def _refuse_backwards(time: NDArray) -> None:
    if runs_backwards(time):
        raise InputError(
            f"its clock runs backwards, by {time[0] - time[-1]:.6g} s from the first row to the"
            " last; turn the order of its rows round, or correct time.column in the map"
        )


def _period(time_s: NDArray) -> float:
    steps = np.diff(time_s)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if len(steps) else np.inf


def _without_strays(rows: NDArray, time_s: NDArray, findings: list[Finding]) -> NDArray:
    """Leave out single stamps far off, between two that follow each other."""
    time = time_s[rows]
    far = max(RESTART_S, RESTART_PERIODS * _period(time))
    step = np.diff(time)
    stray = (
        (np.abs(step[:-1]) > far) & (np.abs(step[1:]) > far) & (np.abs(time[2:] - time[:-2]) < far)
    )
    if stray.any():
        first = rows[int(np.argmax(stray)) + 1]
        seen = (
            f"{counted(int(stray.sum()), 'stamp')} far from both neighbours, the first in row"
            f" {first}"
        )
        findings.append(Finding("time", seen, "left out"))
    return rows[np.concatenate([[True], ~stray, [True]])] if len(rows) > 2 else rows


def _begins(time: NDArray) -> list[int]:
    """Return where a clock begins: at the first row, and wherever it starts over."""
    far = max(RESTART_S, RESTART_PERIODS * _period(time))
    cuts = [0, *(np.flatnonzero(np.diff(time) < -far) + 1), len(time)]
    begins = []
    for first, last in pairwise(cuts):
        begins.append(int(first))
        while (behind := _stays_behind(time[begins[-1] : last])) is not None:
            begins.append(begins[-1] + behind)
    return begins


def _stays_behind(time: NDArray) -> int | None:
    """Return from where on time stays behind what it was for many rows; None where it nowhere
    does."""
    late = time < np.maximum.accumulate(time)
    edges = np.flatnonzero(np.diff(late, prepend=False, append=False))
    starts, ends = edges[::2], edges[1::2]
    long = np.flatnonzero(ends - starts > RESTART_ROWS)
    return int(starts[long[0]]) if len(long) else None


def full_register(before: float, after: float) -> float | None:
    """Return at how much a counter is full that goes back from one stamp to another; None where
    neither says so."""
    near = [limit for limit in REGISTERS if (1.0 - NEAR) * limit < before < limit]
    if not near:
        return None
    return 2.0 * near[0] if after < 0.0 else near[0]  # with a sign it goes on at the lowest number


def _if_full(before: float, after: float) -> str:
    full = full_register(before, after)
    return (
        f"after {before:.10g}: if it was full, set time.wraps_at = {full:.0f}"
        if full
        else "another run begins"
    )


def _ordered(rows: NDArray, time_s: NDArray) -> Run:
    """Return rows in the order of time, one of each stamp, without a few that stand long before the
    rest."""
    findings: list[Finding] = []
    time = time_s[rows]
    back = np.count_nonzero(np.diff(time) < 0.0)
    if back:
        order = np.argsort(time, kind="stable")
        rows, time = rows[order], time[order]
        findings.append(
            Finding(
                "time", f"goes back a little, {counted(int(back), 'time')}", "rows put in order"
            )
        )
    again = np.diff(time, prepend=-np.inf) <= 0.0
    if again.any():
        findings.append(_repeated(int(again.sum()), len(rows), int(rows[np.argmax(again)])))
        rows, time = rows[~again], time[~again]
    first = _lead(time)
    if first:
        seen = f"{counted(first, 'row')} {time[first] - time[first - 1]:.3g} s before the rest"
        findings.append(Finding("time", seen, "left out"))
    return Run(rows[first:], time[first:] - time[first], float(time[first]), tuple(findings))


def _repeated(again: int, rows: int, first: int) -> Finding:
    seen = (
        f"{counted(again, 'row')} ({again / rows:.1%}) with the stamp of another, the first is row"
        f" {first}"
    )
    advice = (
        ""
        if again < 0.05 * rows
        else "; if rows are uniform and the clock is coarse, set time.rate_hz in place of it"
    )
    return Finding("time", seen, f"the first of each kept{advice}")


def _lead(time: NDArray) -> int:
    """Return how many rows stand long before the rest."""
    steps = np.diff(time[: LEAD_ROWS + 1])
    far = np.flatnonzero(steps > max(LEAD_S, LEAD_PERIODS * _period(time)))
    return int(far[-1]) + 1 if len(far) else 0


@dataclass(frozen=True)
class Sampling:
    """How regularly a run was sampled."""

    rate_hz: float
    gaps: Sequence[tuple[float, int]]
    """First missing time (s) and how many samples are missing."""
    steps_s: tuple[float, float, float]
    """The shortest step, the median, and the longest that is no gap."""
    irregular: float
    """Share of the steps that are more than 2 % off the median."""

    @classmethod
    def of(cls, clock_s: NDArray, kept_s: NDArray) -> "Sampling":
        """Look at the steps of a clock (n,), and where of its samples only some (m,) are kept.

        A gap is a step half as long again as 95 % of all steps are: where steps vary, a longer one
        lost nothing.
        """
        # Of what was logged at several rates only a few rows are whole, and they have a rate of
        # their own.
        steps = np.diff(clock_s if 2 * len(kept_s) > len(clock_s) else kept_s)
        median = float(np.median(steps))
        longest = 1.5 * max(median, float(np.quantile(steps, 0.95)))
        regular = steps[steps <= longest]
        period = float(np.mean(regular))
        kept = np.diff(kept_s)
        gaps = [
            (float(kept_s[k] + period), max(1, round(float(kept[k]) / period) - 1))
            for k in np.flatnonzero(kept > longest)
        ]
        irregular = float(np.mean(np.abs(regular - median) > 0.02 * median))
        limits = (float(regular.min()), median, float(regular.max()))
        return cls(_rounded(1.0 / period, len(clock_s)), gaps, limits, irregular)

    @property
    def missing(self) -> int:
        """Samples missing in all gaps."""
        return sum(count for _, count in self.gaps)


def _rounded(rate_hz: float, samples: int) -> float:
    """Return a whole number of Hz where over all samples that makes no difference."""
    whole = float(round(rate_hz))
    return whole if whole and abs(whole - rate_hz) * samples < 0.01 * rate_hz else rate_hz
