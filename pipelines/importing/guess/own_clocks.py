"""Clocks of channels in a log that has several: which column has which, and the slowest of them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.guess.joints import TURNING
from pipelines.importing.guess.time import TimeGuess, guess_time
from pipelines.importing.naming.meaning import Meaning
from pipelines.importing.quantities.numbers import same_stamps
from pipelines.importing.sources.source import Columns
from pipelines.settings.units import UNITS
from pipelines.signals.held import are_held, new_values

EQUALLY_FAST = 1.05
"""Ratio of their stamps up to which two clocks count as equally fast."""


@dataclass(frozen=True)
class OwnClock:
    """The clock of a channel, if that is not the clock of the log."""

    column: str
    unit: str
    scale: float
    offset_s: float = 0.0
    """Added to its times, where it has another origin."""
    as_log: bool = True
    """Whether its unit and scale are those of the clock of the log."""

    def at(self, stamps: NDArray, time: TimeGuess) -> NDArray:
        """Return stamps (n,) in counts of the clock of the log."""
        # Its unit may have been settled since.
        count_s = time.count_s if self.as_log else UNITS[self.unit].factor * self.scale
        return (stamps.astype(float) * count_s + self.offset_s) / time.count_s


def clocks_by_rows(time: TimeGuess, columns: Mapping[str, NDArray]) -> dict[str, str]:
    """Return the rival clock of each column (n,) with new values just where that has new stamps.

    Rows between are blank, or repeat the values before. A rival with a new stamp in each row of the
    main clock is not distinguished by rows.
    """
    clocks: dict[str, str] = {}
    for rival in time.rivals:
        rows = _rows_of(columns[rival])
        if not np.array_equal(rows, _rows_of(columns[time.column])):
            own = {name for name in columns if np.array_equal(_rows_of(columns[name]), rows)}
        else:
            own = {name for name in columns if _are_new_with(columns[name], columns[rival])}
        clocks |= {name: rival for name in own - {rival, time.column}}
    return clocks


def _rows_of(values: NDArray) -> NDArray:
    return np.isfinite(values) if values.dtype.kind == "f" else np.ones(len(values), bool)


def _are_new_with(values: NDArray, stamps: NDArray) -> bool:
    """Return whether values (n,) are held, and new only in rows with a new stamp."""
    # Share of rows with a new stamp above which a clock is that of all rows.
    all_rows = 0.9
    # Least share of the new values that come with a new stamp: a logger may delay one of both.
    with_stamp = 0.95
    if values.dtype.kind not in "iuf" or len(values) != len(stamps):
        return False
    ticks = new_values(stamps.astype(float))
    if len(ticks) > all_rows * len(stamps) or not are_held(values.astype(float)):
        return False
    return bool(np.mean(np.isin(new_values(values.astype(float)), ticks)) > with_stamp)


def with_slowest(
    time: TimeGuess,
    clocks: Mapping[str, str],
    names: Sequence[Meaning],
    columns: Columns,
    typed: Mapping[str, str],
) -> tuple[TimeGuess, dict[str, str]]:
    """Return the slowest clock of an angle or torque, and the clock of each other column.

    Straight lines are accurate between samples that are closer than the rows, so that the other
    channels are interpolated.

    Parameters
    ----------
    time : TimeGuess
        The clock of the columns that are not in ``clocks``.
    clocks : mapping of str to str
        Clocks of columns that have one of their own.
    names : sequence of Meaning
        Meanings of the columns' names.
    columns : mapping of str to (n,) array
        The columns.
    typed : mapping of str to str
        Units of columns that are dates or durations.
    """
    needed = [m for m in names if m.quantity in ("angle", *TURNING) and not m.commanded]
    own = {clocks.get(m.column, time.column) for m in needed if _moves(columns[m.column])}
    stamps = {name: _distinct(columns[name]) for name in own | {time.column}}
    slowest = min(own | {time.column}, key=lambda name: (len(stamps[name]), name))
    if EQUALLY_FAST * len(stamps[slowest]) > len(stamps[time.column]):
        return time, dict(clocks)
    meaning = next(m for m in names if m.column == slowest)
    guess = guess_time([meaning], columns | {slowest: stamps[slowest]}, typed)
    if guess is None:
        return time, dict(clocks)
    rivals = tuple(time.column if name == slowest else name for name in time.rivals)
    rows = len(columns[time.column])
    of_rows = {name: time.column for name in columns if len(columns[name]) == rows}
    is_clock = {time.column, slowest, *clocks.values()}
    all_clocks = {n: c for n, c in (of_rows | dict(clocks)).items() if n not in is_clock}
    others = {name: clock for name, clock in all_clocks.items() if clock != slowest}
    return replace(guess, rivals=rivals, is_slowest=True), others


def _moves(values: NDArray) -> bool:
    return len(_distinct(values)) > 1


def _distinct(values: NDArray) -> NDArray:
    """Return the values (n,) that are known, and differ from the last one."""
    if values.dtype.kind not in "iuf" or not len(values):
        return values
    known = values[np.isfinite(values)]
    return known[np.diff(known, prepend=np.nan) != 0.0]


def own_clocks(
    clocks: Collection[str],
    time: TimeGuess,
    names: Sequence[Meaning],
    columns: Columns,
    typed: Mapping[str, str],
) -> dict[str, OwnClock]:
    """Return the clocks of channels, with their units and origins relative to the log's clock.

    Parameters
    ----------
    clocks : collection of str
        Their columns.
    time : TimeGuess
        The clock of the log.
    names : sequence of Meaning
        Meanings of the columns' names.
    columns : mapping of str to (n,) array
        The columns.
    typed : mapping of str to str
        Units of columns that are dates or durations.
    """
    clocks_of_channels: dict[str, OwnClock] = {}
    log_s = _distinct(columns[time.columns[0]]).astype(float) * UNITS[time.unit].factor * time.scale
    for name in dict.fromkeys(clocks):
        own = _distinct(columns[name])
        if own.dtype.kind not in "iuf" or not len(own) or same_stamps(own, columns[time.column]):
            continue
        meaning = next(m for m in names if m.column == name)
        guess = guess_time([meaning], columns | {name: own}, typed)
        # One that shows no unit has that of the log.
        unit, scale = (guess.unit, guess.scale) if guess else (time.unit, time.scale)
        own_s = own.astype(float) * UNITS[unit].factor * scale
        apart = own_s[0] > log_s[-1] or own_s[-1] < log_s[0]
        offset_s = float(log_s[0] - own_s[0]) if apart else 0.0
        as_log = (unit, scale) == (time.unit, time.scale)
        clocks_of_channels[name] = OwnClock(name, unit, scale, offset_s, as_log)
    return clocks_of_channels
