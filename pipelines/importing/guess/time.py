"""Which column is the clock, and in which unit."""

import itertools
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.importing import clock
from pipelines.importing.guess.names import Meaning
from pipelines.importing.guess.proposal import Proposal
from pipelines.settings.units import UNITS

ADVANCES = 0.9
"""Share of the steps of a clock that go forward."""


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

    def stamps(self, values: NDArray) -> NDArray:
        """Return the stamps of rows (n,) in the clock's unit, from what stands in its column."""
        return values if self.rate_hz is None else np.arange(len(values)) / (self.rate_hz * UNITS[self.unit].factor)


def guess_time(meanings: Sequence[Meaning], columns: Mapping[str, NDArray], dates: Container[str]) -> TimeGuess | None:
    """Return the clock among columns (n,), of which ``dates`` were written out, here in ns; None where none is one."""
    advancing = [meaning for meaning in meanings if _advances(columns[meaning.column])]
    named_so = [meaning for meaning in meanings if meaning.quantity == "time"]
    coarse = [meaning for meaning in named_so if _stands_still(columns[meaning.column])]
    candidates = [meaning for meaning in advancing if meaning.quantity == "time"] or coarse or advancing
    for found in sorted(candidates, key=lambda meaning: meaning.unit is None):
        values = columns[found.column].astype(float)
        step = _step(values, found in coarse)
        fitting = clock.usual_units(step)
        unit = found.unit if found.unit and UNITS[found.unit].dimension == "time" else None
        unit = "iso8601" if found.column in dates else unit
        if unit is None and not fitting:
            continue
        chosen = unit or fitting[0]
        rate = f"{1.0 / (step * UNITS[chosen].factor):.4g} Hz"
        said = "dates written out" if unit == "iso8601" else "its name says so" if unit else ""
        why = f"{said}: {rate}" if said else f"steps of {step:.4g} are {rate} in {chosen}, and no rate in another"
        named = found.quantity == "time"
        wraps_at, restarts = _breaks(values, chosen)
        usual = clock.SLOWEST_HZ <= 1.0 / (step * UNITS[chosen].factor) <= clock.FASTEST_HZ
        why += "" if named else "; no name says which column is the time"
        why += "" if usual else f", at which no machine is sampled: is it {' or '.join(fitting) or 'another column'}?"
        even = 1.0 / (step * UNITS[chosen].factor) if found in coarse else None
        return TimeGuess(found.column, chosen, why, named, named and usual, wraps_at, restarts, even)
    return None


def write_time(proposal: Proposal, found: TimeGuess) -> None:
    """Write the clock's table."""
    proposal.table("[time]", "time")
    if found.rate_hz is not None:
        why = f"several rows have one stamp of {found.column}; taken for uniform, {found.unit} for its unit"
        proposal.key("rate_hz", float(f"{found.rate_hz:.6g}"), why, sure=False)
        return
    proposal.key("column", found.column, _how_it_goes(found), found.sure)
    proposal.key("unit", found.unit, found.why, found.unit_sure)
    if found.wraps_at:
        proposal.key("wraps_at", found.wraps_at, "goes back where such a counter is full")
    elif found.restarts:
        proposal.key("restarts", "longest", 'the clock starts over; "split" makes a recording of each run', sure=False)


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
    """Tell whether a column (n,) is a clock that is too coarse for its rows: it never goes back, and seldom on."""
    if values.dtype.kind not in "iuf" or len(values) < 10:
        return False
    steps = np.diff(values.astype(float))
    return bool(np.all(steps >= 0.0) and 0.0 < np.mean(steps > 0.0) <= ADVANCES)


def _step(values: NDArray, coarse: bool) -> float:
    """Return the step from one row to the next."""
    if coarse:
        # Rows before the first step and after the last are of stamps that were not seen whole.
        whole = np.flatnonzero(np.diff(values))
        if len(whole) > 1:
            return float((values[whole[-1]] - values[whole[0]]) / (whole[-1] - whole[0]))
        return float((values[-1] - values[0]) / (len(values) - 1))
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
