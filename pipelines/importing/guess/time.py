"""Which column is the clock, and in which unit."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.guess.names import Meaning
from pipelines.importing.guess.proposal import Proposal
from pipelines.importing.time import clock
from pipelines.settings.units import UNITS

ADVANCES = 0.9
"""Share of the steps of a clock that go forward."""
ALIKE, UNEVEN = 2.0, 0.1
"""Stamps have as many rows as usual, and are as far apart, within this factor; of how many may have
others."""
NEAR = 0.1
"""By so much the rates of two clocks of the same rows may differ, as a share."""
SAID = {"iso8601": "dates written out", "ns": "durations, here in whole ns"}
"""Why a unit is that which the file tells."""


@dataclass(frozen=True)
class TimeGuess:
    """The clock of a log."""

    column: str
    unit: str
    why: str
    sure: bool
    unit_sure: bool
    wraps_at: float | None
    restarts: bool
    rate_hz: float | None = None
    """Of rows that are uniform, where the clock is too coarse to tell them apart."""
    pause_s: float = 0.0
    """The longest that a coarse clock went on without rows."""

    def stamps(self, values: NDArray) -> NDArray:
        """Return the stamps of rows (n,) in the clock's unit, from what stands in its column."""
        return (
            values
            if self.rate_hz is None
            else np.arange(len(values)) / (self.rate_hz * UNITS[self.unit].factor)
        )


def guess_time(
    meanings: Sequence[Meaning], columns: Mapping[str, NDArray], told: Mapping[str, str]
) -> TimeGuess | None:
    """Return the clock among columns (n,), in ``told`` units where the file says them; None where
    none is one."""
    advancing = [meaning for meaning in meanings if _advances(columns[meaning.column])]
    named_so = [meaning for meaning in meanings if meaning.quantity == "time"]
    coarse = [
        m
        for m in named_so
        if _stands_still(columns[m.column]) and _is_even(columns[m.column].astype(float))
    ]
    named = [meaning for meaning in advancing if meaning.quantity == "time"]
    candidates = named or _finer(advancing, coarse, columns, told) or coarse or advancing
    for found in sorted(candidates, key=lambda meaning: meaning.unit is None):
        values = columns[found.column].astype(float)
        step = _step(values, found in coarse)
        fitting = clock.usual_units(step)
        unit = _unit(found, told)
        if unit is None and not fitting:
            continue
        chosen = unit or fitting[0]
        rate_hz = _rate_hz(step, chosen)
        rate = f"{rate_hz:.4g} Hz"
        said = SAID.get(told.get(found.column, ""), "its name says so") if unit else ""
        why = (
            f"{said}: {rate}"
            if said
            else f"steps of {step:.4g} are {rate} in {chosen}, and no rate in another"
        )
        called_so = found.quantity == "time"
        wraps_at, restarts = _breaks(values, chosen)
        usual = _is_usual(rate_hz)
        why += "" if called_so else "; no name says which column is the time"
        why += (
            ""
            if usual
            else (
                ", at which no machine is sampled: is it"
                f" {' or '.join(fitting) or 'another column'}?"
            )
        )
        pause_s = _longest_pause(values) * UNITS[chosen].factor if found in coarse else 0.0
        even = rate_hz if found in coarse else None
        return TimeGuess(
            found.column,
            chosen,
            why,
            called_so,
            called_so and usual,
            wraps_at,
            restarts,
            even,
            pause_s,
        )
    return None


def _unit(found: Meaning, told: Mapping[str, str]) -> str | None:
    """Return the unit of a clock that is known: what the file tells goes before what its name
    says."""
    named = found.unit if found.unit and UNITS[found.unit].dimension == "time" else None
    return told.get(found.column, named)


def _finer(
    advancing: Sequence[Meaning],
    coarse: Sequence[Meaning],
    columns: Mapping[str, NDArray],
    told: Mapping[str, str],
) -> list[Meaning]:
    """Return the clocks without a name that tell the same rate as a coarse one; what else rises has
    another."""
    rates = [
        rate
        for m in coarse
        for _, rate in _usual_rates(m, _step(columns[m.column].astype(float), True), told)
    ]
    finer = []
    for found in advancing if rates else ():
        values = columns[found.column].astype(float)
        own = [] if found.quantity else _usual_rates(found, _step(values, False), told)
        if any(
            abs(hz / rate - 1.0) < NEAR and not _breaks(values, unit)[1]
            for unit, hz in own
            for rate in rates
        ):
            finer.append(found)
    return finer


def _usual_rates(found: Meaning, step: float, told: Mapping[str, str]) -> list[tuple[str, float]]:
    """Return the units that a clock of such a step may be in, each with its rate, Hz, where
    machines have such."""
    unit = _unit(found, told)
    rates = [(one, _rate_hz(step, one)) for one in ([unit] if unit else clock.usual_units(step))]
    return [(one, rate) for one, rate in rates if _is_usual(rate)]


def _rate_hz(step: float, unit: str) -> float:
    return 1.0 / (step * UNITS[unit].factor)


def _is_usual(rate_hz: float) -> bool:
    return clock.SLOWEST_HZ <= rate_hz <= clock.FASTEST_HZ


def write_time(proposal: Proposal, found: TimeGuess) -> None:
    """Write the clock's table."""
    proposal.table("[time]", "time")
    if found.rate_hz is not None:
        why = (
            f"several rows have one stamp of {found.column}; taken for uniform, {found.unit} for"
            " its unit"
        )
        if found.pause_s:
            why += f"; but none came for {found.pause_s:.3g} s, which `rate_hz` leaves no gap for"
        proposal.key("rate_hz", float(f"{found.rate_hz:.6g}"), why, sure=False)
        return
    proposal.key("column", found.column, _how_it_goes(found), found.sure)
    proposal.key("unit", found.unit, found.why, found.unit_sure)
    if found.wraps_at:
        proposal.key("wraps_at", found.wraps_at, "goes back where such a counter is full")
    elif found.restarts:
        proposal.key(
            "restarts",
            "longest",
            'the clock starts over; "split" makes a recording of each run',
            sure=False,
        )


def _how_it_goes(found: TimeGuess) -> str:
    but = ", but starts over" if found.wraps_at or found.restarts else ""
    return "goes forward" + but + ("" if found.sure else ", as no other does")


def _advances(values: NDArray) -> bool:
    if values.dtype.kind not in "iuf" or len(values) < 10:
        return False
    steps = np.diff(values.astype(float))
    if np.all(steps == 1.0):
        return False  # a counter of rows
    return bool(np.mean(steps > 0) > ADVANCES)


def _stands_still(values: NDArray) -> bool:
    """Tell whether a column (n,) is a clock that is too coarse for its rows: it never goes back,
    and seldom on."""
    if values.dtype.kind not in "iuf" or len(values) < 10:
        return False
    steps = np.diff(values.astype(float))
    return bool(np.all(steps >= 0.0) and 0.0 < np.mean(steps > 0.0) <= ADVANCES)


def _stamps(values: NDArray) -> tuple[NDArray, NDArray]:
    """Return how many rows each stamp of a coarse clock (n,) has, (k,), and how far it is to the
    next, (k,).

    Rows before the first step and after the last are of stamps that were not seen whole.
    """
    begins = np.flatnonzero(np.diff(values)) + 1
    return np.diff(begins), np.diff(values[begins])


def _alike(numbers: NDArray) -> NDArray:
    """Return which of some numbers (k,) are near their median."""
    median = np.median(numbers)
    return (numbers * ALIKE >= median) & (numbers <= ALIKE * median)


def _is_even(values: NDArray) -> bool:
    """Tell whether stamps of a coarse clock (n,) have much the same number of rows."""
    rows, _ = _stamps(values)
    return not len(rows) or bool(np.mean(~_alike(rows)) <= UNEVEN)


def _longest_pause(values: NDArray) -> float:
    """Return the longest step of a coarse clock (n,) that is none of its own; 0 where there is
    none."""
    _, steps = _stamps(values)
    return (
        float(np.max(steps[steps > ALIKE * np.median(steps)], initial=0.0)) if len(steps) else 0.0
    )


def _step(values: NDArray, coarse: bool) -> float:
    """Return the step from one row to the next."""
    if coarse:
        rows, steps = _stamps(values)
        if not len(rows):
            return float((values[-1] - values[0]) / (len(values) - 1))
        # Around the medians: these alone would round the rows of a stamp, of which there are three
        # or four by turns.
        usual = _alike(rows) & _alike(steps)
        return (
            float(np.sum(steps[usual]) / np.sum(rows[usual]))
            if usual.any()
            else np.median(steps) / np.median(rows)
        )
    steps = np.diff(values)
    return float(np.median(steps[steps > 0]))


def _breaks(values: NDArray, unit: str) -> tuple[float | None, bool]:
    """Return where the clock is full, where it looks so, and whether it starts over."""
    runs = clock.runs((values - clock.first_stamp(values)) * UNITS[unit].factor, values, [])
    full = [
        clock.full_register(values[before.rows[-1]], values[after.rows[0]])
        for before, after in itertools.pairwise(runs)
    ]
    return (full[0], False) if full and full[0] and len(set(full)) == 1 else (None, len(runs) > 1)
