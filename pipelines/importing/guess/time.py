"""Choose the column of the clock, and its unit."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.guess.joints import JointColumns
from pipelines.importing.guess.motion import CLEAR, EXACT, FROM_NAME, factors
from pipelines.importing.guess.proposal import Proposal
from pipelines.importing.naming.meaning import Meaning
from pipelines.importing.naming.unit_in_name import count_of
from pipelines.importing.quantities.consistency import integral_agreement
from pipelines.importing.quantities.numbers import are_whole
from pipelines.importing.time import clock
from pipelines.settings.units import UNITS

ADVANCES = 0.9
"""Least share of the steps of a clock that go forward."""
DAY_S = 86_400.0
"""A day, s."""
LONG = ("min", "d", "h")
"""Units that a clock with decimals may have, though few do; the likelier first."""
USUAL = 2.0
"""Factor on the median within which stamps of a coarse clock are usual, in rows and in distance."""


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
    """Rate of uniform rows, where the clock is too coarse; else None."""
    pause_s: float = 0.0
    """Longest step of a coarse clock without rows, s."""
    scale: float = 1.0
    """Units in a count of the stamps."""
    others: tuple[tuple[str, float], ...] = ()
    """Units and scales that give a usual rate, too."""
    plus: str | None = None
    """Column of the fractions of a second."""
    plus_unit: str = "ns"
    rivals: tuple[str, ...] = ()
    """Other clocks of the log, with other times."""
    is_slowest: bool = False
    """Whether it is the slowest of several clocks, and each other channel has its own."""

    @property
    def columns(self) -> list[str]:
        """The columns of the clock."""
        return [self.column] if self.plus is None else [self.column, self.plus]

    @property
    def count_s(self) -> float:
        """Duration of a count of the stamps, s."""
        if self.plus is not None:
            return UNITS[self.plus_unit].factor
        return UNITS[self.unit].factor * self.scale

    def stamps(self, values: NDArray, plus: NDArray | None = None) -> NDArray:
        """Return the stamps of rows.

        Parameters
        ----------
        values : (n,) array
            The clock's column.
        plus : (n,) array, optional
            The column of the fractions.

        Returns
        -------
        (n,) array
            In the clock's unit.
        """
        if plus is not None:
            return _together(values, plus, self.plus_unit, self.unit)
        if self.rate_hz is None:
            return values
        return np.arange(len(values)) / (self.rate_hz * self.count_s)


def guess_time(
    meanings: Sequence[Meaning], columns: Mapping[str, NDArray], typed: Mapping[str, str]
) -> TimeGuess | None:
    """Return the clock of a log.

    Parameters
    ----------
    meanings : sequence of Meaning
        Meanings of the columns' names.
    columns : mapping of str to (n,) array
        The columns.
    typed : mapping of str to str
        Units of columns that are dates or durations.

    Returns
    -------
    TimeGuess or None
        None where no column is a clock.
    """
    of_two = _of_two_columns(columns, typed)
    if of_two is not None:
        return of_two
    advancing = [m for m in meanings if _advances(columns[m.column], m.quantity == "time")]
    coarse = [
        m
        for m in meanings
        if m.quantity == "time"
        and _stands_still(columns[m.column])
        and _is_even(columns[m.column].astype(float))
    ]
    named = [m for m in advancing if m.quantity == "time"]
    # The best evidence first. A coarse named clock gives way to a finer one of its rate.
    candidates = named or _finer(advancing, coarse, columns, typed) or coarse or advancing
    # False sorts first: a column with a unit in its name is the better evidence.
    for meaning in sorted(candidates, key=lambda m: m.unit is None):
        guess = _guess(meaning, columns[meaning.column].astype(float), meaning in coarse, typed)
        if guess is not None:
            # A slower clock of a table ends before the others, or is blank in rows between. Where
            # no name says time, its own does not, either.
            partial = [
                m
                for m in meanings
                if m not in named
                and (m.quantity == "time" or not (named or m.quantity))
                and _advances_in_its_rows(m, columns)
            ]
            clocks = [(m.column, _count_s(m, typed, guess.unit)) for m in named + coarse + partial]
            return replace(guess, rivals=tuple(_rivals(guess, clocks, columns)))
    return None


def _of_two_columns(columns: Mapping[str, NDArray], typed: Mapping[str, str]) -> TimeGuess | None:
    """Return the clock of a log that has whole seconds and their fractions in two columns.

    The seconds are a number, or a time of day, as in the columns Time and Millitm of FactoryTalk.
    """
    whole = {
        name: values
        for name, values in columns.items()
        if values.dtype.kind in "iu" and len(values) > 9
    }
    for seconds, values in whole.items():
        unit = "iso8601" if typed.get(seconds) == "iso8601" else "s"
        steps = np.diff(_whole_seconds(values, unit).astype(float))
        # A time of day goes on after midnight.
        steps = np.where(steps == 1.0 - DAY_S, 1.0, steps) if unit == "iso8601" else steps
        if not (steps.any() and np.isin(steps, (0.0, 1.0)).all() and np.mean(steps) < 0.5):
            continue
        if np.any(np.diff(values)[steps == 0.0]):  # it has fractions of its own
            continue
        for name, fractions in whole.items():
            full = next(
                (unit for unit in ("ms", "us", "100ns", "ns") if _fills(fractions, unit)), None
            )
            # The fractions start over where a second is full, and nowhere else.
            if full and np.array_equal(np.diff(fractions.astype(float)) < 0.0, steps > 0.0):
                stamps = _together(values, fractions, full, unit)
                step = clock.period(stamps.astype(float))
                why = f"seconds, with fractions in {name}: {_rate_hz(step, full):.4g} Hz"
                return TimeGuess(
                    seconds, unit, why, True, True, None, False, plus=name, plus_unit=full
                )
    return None


def _whole_seconds(values: NDArray, unit: str) -> NDArray:
    """Return seconds (n,) as integers, of dates in nanoseconds too."""
    whole = values.astype(np.int64)
    return whole // round(1.0 / UNITS[unit].factor) if unit == "iso8601" else whole


def _fills(fractions: NDArray, unit: str) -> bool:
    """Return whether whole numbers (n,) are fractions of a second in a unit."""
    full = 1.0 / UNITS[unit].factor
    return bool(len(fractions)) and 0 <= fractions.min() and 0.5 * full < fractions.max() < full


def _together(seconds: NDArray, fractions: NDArray, unit: str, of_seconds: str) -> NDArray:
    """Return the stamps of seconds (n,) and their fractions, in the unit of these."""
    whole = _whole_seconds(seconds, of_seconds)
    return whole * round(1.0 / UNITS[unit].factor) + fractions.astype(np.int64)


def _rivals(
    guess: TimeGuess, clocks: Sequence[tuple[str, float]], columns: Mapping[str, NDArray]
) -> Iterator[str]:
    """Yield the other named clocks, with the length of a count (s), of other times."""
    time_s = columns[guess.column].astype(float) * guess.count_s
    for name, count_s in clocks:
        other_s = columns[name].astype(float) * count_s
        if name == guess.column or len(other_s) != len(time_s):
            continue
        # Clocks of two devices are apart by a little, or drift. A date, and the time since the log
        # began, are far apart, and always by the same.
        apart, period = other_s - time_s, clock.period(time_s)
        if np.nanmax(apart) - np.nanmin(apart) > 0.5 * period or (
            0.01 * period < abs(np.nanmedian(apart)) < 1.0
        ):
            yield name


def _guess(
    meaning: Meaning, values: NDArray, coarse: bool, typed: Mapping[str, str]
) -> TimeGuess | None:
    """Return a column as a clock; None where no unit gives a usual rate."""
    step = _step(values, coarse)
    known, epoch = _unit(meaning, typed), _epoch(values, step)
    fitting = [(known, 1.0)] if known else _scales(values, step)
    if epoch and not known:
        fitting = [epoch[:2], *(one for one in fitting if one != epoch[:2])]
    stated = None if known else count_of(meaning.unread)
    if stated:
        fitting = [stated, *(one for one in fitting if not _are_equal(one, stated))]
    if not fitting:
        return None
    unit, scale = fitting[0]
    count_s = UNITS[unit].factor * scale
    rate_hz = 1.0 / (step * count_s)
    is_usual = clock.SLOWEST_HZ <= rate_hz <= clock.FASTEST_HZ
    is_named = meaning.quantity == "time"
    others = () if known or epoch else tuple(fitting[1:])
    if known:
        by_type = {"iso8601": "dates written out", "ns": "durations, here in whole ns"}
        why = f"{by_type.get(typed.get(meaning.column, ''), FROM_NAME)}: {rate_hz:.4g} Hz"
    elif stated:
        why = f"its name says {meaning.unread!r}: {rate_hz:.4g} Hz"
    elif epoch:
        why = f"{epoch[2]}: {rate_hz:.4g} Hz"
    else:
        why = f"steps of {step:.4g} are {rate_hz:.4g} Hz in {unit}, and no rate in another"
        if others:
            rates = (f"{1.0 / (step * UNITS[u].factor * k):.4g} Hz in {k:g} {u}" for u, k in others)
            why = (
                f"steps of {step:.4g} are {rate_hz:.4g} Hz in {scale:g} {unit}, {', '.join(rates)}"
            )
    if not is_named:
        why += "; no name shows which column is the time"
    if meaning.unread and not stated:
        why += f"; its name says {meaning.unread!r}: set unit and scale by that"
    if not is_usual:
        usual = clock.usual_units(step)
        why += f", no usual rate: is it {' or '.join(usual) or 'another column'}?"
    wraps_at, restarts = _breaks(values, count_s)
    return TimeGuess(
        meaning.column,
        unit,
        why,
        sure=is_named,
        unit_sure=is_named
        and is_usual
        and not others
        and not meaning.unread
        and (unit not in LONG or bool(known or epoch)),
        wraps_at=wraps_at,
        restarts=restarts,
        rate_hz=rate_hz if coarse else None,
        pause_s=_longest_pause(values) * count_s if coarse else 0.0,
        scale=scale,
        others=others,
    )


def _scales(values: NDArray, step: float) -> list[tuple[str, float]]:
    """Return units, and scales, of a clock (n,) of such a step that give a usual rate.

    Whole numbers may count ticks of any power of ten of a second: several powers give a usual
    rate, so that nothing but a name, a date or the motion decides.
    """
    tried = [(unit, 1.0) for unit in ("s", "ms", "us", "ns")]
    if are_whole(values):
        tried += [("100ns", 1.0), ("ms", 0.1), ("us", 10.0), ("ms", 10.0), ("s", 0.1), ("ns", 10.0)]
    else:
        tried += [(unit, 1.0) for unit in LONG]
    usual = [one for one in tried if clock.usual_units(step * one[1], [one[0]])]
    # A clock with decimals is hardly one in minutes, if it may be one in seconds.
    return usual if are_whole(values) or (usual[:1] and usual[0][0] in LONG) else usual[:1]


def _epoch(values: NDArray, step: float) -> tuple[str, float, str] | None:
    """Return unit, scale and words of a clock whose first stamp is a date of our time, if any."""
    known = values[np.isfinite(values)]
    dates = (
        *(
            (unit, 0.9e9 / UNITS[unit].factor, 2.6e9 / UNITS[unit].factor, "dates since 1970")
            for unit in ("s", "ms", "us", "ns")
        ),
        ("s", 2.9e9, 4.7e9, "seconds since 1904, as LabVIEW counts"),
        ("100ns", 1.25e17, 1.45e17, "a FILETIME, since 1601"),
        ("100ns", 6.3e17, 6.6e17, "ticks of .NET, since the year 1"),
        ("d", 7.2e5, 7.6e5, "days of MATLAB's datenum"),
        ("d", 3.6e4, 6e4, "days of a spreadsheet, since 1900"),
    )
    for unit, least, most, words in dates:
        if len(known) and least < known[0] < most and clock.usual_units(step, [unit]):
            return unit, 1.0, words
    return None


def settled(
    guess: TimeGuess,
    joints: Sequence[JointColumns],
    columns: Mapping[str, NDArray],
    time_s: NDArray,
) -> TimeGuess:
    """Return the clock in the unit in which a velocity integrates to its angle.

    Parameters
    ----------
    guess : TimeGuess
        The clock.
    joints : sequence of JointColumns
        The joints.
    columns : mapping of str to (n,) array
        Columns of a run.
    time_s : (n,) array
        Its times by this guess, s.
    """
    for joint in joints if guess.others else ():
        if not {"angle", "velocity"} <= joint.columns.keys():
            continue
        angle, velocity = (joint.columns[name] for name in ("angle", "velocity"))
        agreement = integral_agreement(
            time_s, *(columns[m.column].astype(float) for m in (angle, velocity))
        )
        if agreement is None or agreement.explained < CLEAR:
            continue
        for unit, scale in ((guess.unit, guess.scale), *guess.others):
            slope = abs(agreement.slope) * UNITS[unit].factor * scale / guess.count_s
            if any(
                abs(factor - 1.0) < EXACT for factor in factors(slope, angle.unit, velocity.unit)
            ):
                doubted = angle.doubt or velocity.doubt
                named = guess.sure and bool(angle.unit and velocity.unit) and not doubted
                why = f"{guess.why}; in {scale:g} {unit} the velocity integrates to the angle"
                return replace(guess, unit=unit, scale=scale, why=why, unit_sure=named)
    return guess


def _unit(meaning: Meaning, typed: Mapping[str, str]) -> str | None:
    """Return the known unit of a clock; the type of the column takes precedence over its name."""
    named = meaning.unit if meaning.unit and UNITS[meaning.unit].dimension == "time" else None
    return typed.get(meaning.column, named)


def _count_s(meaning: Meaning, typed: Mapping[str, str], usual: str) -> float:
    """Return the duration of a count of a clock, s, by its name, else in the usual unit."""
    unit, scale = count_of(meaning.unread) or (usual, 1.0)
    return UNITS[_unit(meaning, typed) or unit].factor * scale


def _are_equal(one: tuple[str, float], other: tuple[str, float]) -> bool:
    """Return whether two units with their scales are the same duration."""
    durations = [UNITS[unit].factor * scale for unit, scale in (one, other)]
    return abs(durations[0] / durations[1] - 1.0) < 1e-9


def _finer(
    advancing: Sequence[Meaning],
    coarse: Sequence[Meaning],
    columns: Mapping[str, NDArray],
    typed: Mapping[str, str],
) -> list[Meaning]:
    """Return the clocks without a name that have the rate of a coarse one."""
    rates = [
        rate
        for m in coarse
        for _, rate in _usual_rates(m, _step(columns[m.column].astype(float), True), typed)
    ]
    finer = []
    for meaning in advancing if rates else ():
        values = columns[meaning.column].astype(float)
        own = [] if meaning.quantity else _usual_rates(meaning, _step(values, False), typed)
        if any(
            # The rates of two clocks of the same rows differ by less than 10 %. A finer clock must
            # not start over: a coarse one never goes back.
            abs(hz / rate - 1.0) < 0.1 and not _breaks(values, UNITS[unit].factor)[1]
            for unit, hz in own
            for rate in rates
        ):
            finer.append(meaning)
    return finer


def _usual_rates(
    meaning: Meaning, step: float, typed: Mapping[str, str]
) -> list[tuple[str, float]]:
    """Return the units of a clock of such a step that give usual rates, with the rates, Hz."""
    known = _unit(meaning, typed)
    units = clock.usual_units(step, [known]) if known else clock.usual_units(step)
    return [(unit, _rate_hz(step, unit)) for unit in units]


def _rate_hz(step: float, unit: str) -> float:
    return 1.0 / (step * UNITS[unit].factor)


def write_time(proposal: Proposal, guess: TimeGuess, held: Sequence[str]) -> None:
    """Write the clock's table; ``held`` are columns that repeat values between new ones."""
    proposal.table("[time]", "time")
    if held:
        why = f"{', '.join(held)} repeat their values between new ones"
        proposal.key("keep", "new", why)
    if guess.rate_hz is not None:
        why = f"several rows have one stamp of {guess.column}; taken for uniform, in {guess.unit}"
        if guess.pause_s:
            why += f"; but none came for {guess.pause_s:.3g} s, which `rate_hz` ignores"
        proposal.key("rate_hz", float(f"{guess.rate_hz:.6g}"), why, sure=False)
        return
    why = "goes forward"
    if guess.wraps_at or guess.restarts:
        why += ", but starts over"
    if not guess.sure and not guess.rivals:
        why += ", as no other does"
    if guess.is_slowest:
        why += ", the slowest clock of an angle or torque"
        if guess.rivals:
            others = " and ".join(guess.rivals)
            why += f"; set time_offset_s at the channels of {others} if they did not begin together"
    elif guess.rivals:
        why += f", and so does {' and '.join(guess.rivals)}: name it as `time` of its channels"
        why += ", with time_offset_s if they did not begin together, and let the slowest be [time]"
    proposal.key("column", guess.column, why, guess.sure and not guess.rivals)
    proposal.key("unit", guess.unit, guess.why, guess.unit_sure)
    if guess.plus is not None:
        proposal.key("plus", guess.plus, "starts over with each second")
        proposal.key("plus_unit", guess.plus_unit)
    if guess.scale != 1.0:
        proposal.key("scale", guess.scale, "as of the unit", guess.unit_sure)
    # Times of day go on after midnight by themselves; minutes and seconds do not after an hour.
    if guess.wraps_at and (guess.unit != "iso8601" or guess.wraps_at * guess.count_s < DAY_S):
        usual = clock.is_usual_modulus(guess.wraps_at, guess.count_s)
        why = "goes back where such a counter is full"
        if not usual:
            why += "; if the clock was restarted, remove it and choose time.restarts"
        proposal.key("wraps_at", guess.wraps_at, why, usual)
    elif guess.restarts and not guess.wraps_at:
        why = 'the clock starts over; "split" makes a recording of each run'
        proposal.key("restarts", "longest", why, sure=False)


def _advances(values: NDArray, is_named: bool) -> bool:
    """Return whether a column (n,) may be a clock; a counter of rows is one only by its name."""
    if values.dtype.kind not in "iuf" or len(values) < 10:
        return False
    steps = np.diff(values.astype(float))
    if np.all(steps == 1.0) and not is_named:
        return False
    return bool(np.mean(steps > 0) > ADVANCES)


def _advances_in_its_rows(meaning: Meaning, columns: Mapping[str, NDArray]) -> bool:
    """Return whether a column increases, with blanks in some rows."""
    values = columns[meaning.column]
    if values.dtype.kind != "f":
        return False
    known = np.isfinite(values)
    return not known.all() and _advances(values[known], is_named=True)


def _stands_still(values: NDArray) -> bool:
    """Return whether a column (n,) is a clock too coarse for its rows, that never goes back."""
    if values.dtype.kind not in "iuf" or len(values) < 10:
        return False
    steps = np.diff(values.astype(float))
    return bool(np.all(steps >= 0.0) and 0.0 < np.mean(steps > 0.0) <= ADVANCES)


def _stamps(values: NDArray) -> tuple[NDArray, NDArray]:
    """Return the rows of each stamp of a coarse clock, and its distance from the next.

    The first and the last of the stamps (n,) are left out, as their rows may not be complete.
    """
    begins = np.flatnonzero(np.diff(values)) + 1
    return np.diff(begins), np.diff(values[begins])


def _near_median(numbers: NDArray) -> NDArray:
    """Return a mask of the numbers (k,) within a factor of their median."""
    median = np.median(numbers)
    return (numbers * USUAL >= median) & (numbers <= USUAL * median)


def _is_even(values: NDArray) -> bool:
    """Return whether most stamps of a coarse clock (n,) have a similar number of rows."""
    # Largest share of stamps of a coarse clock that are not usual.
    uneven = 0.1
    rows, _ = _stamps(values)
    return not len(rows) or bool(np.mean(~_near_median(rows)) <= uneven)


def _longest_pause(values: NDArray) -> float:
    """Return the longest unusual step of a coarse clock (n,); 0 where there is none."""
    _, steps = _stamps(values)
    if not len(steps):
        return 0.0
    return float(np.max(steps[steps > USUAL * np.median(steps)], initial=0.0))


def _step(values: NDArray, coarse: bool) -> float:
    """Return the step from one row to the next."""
    if coarse:
        rows, steps = _stamps(values)
        if not len(rows):
            return float((values[-1] - values[0]) / (len(values) - 1))
        # A mean of the usual stamps: a median would round, as stamps may have three or four rows
        # in turn.
        usual = _near_median(rows) & _near_median(steps)
        if usual.any():
            return float(np.sum(steps[usual]) / np.sum(rows[usual]))
        return np.median(steps) / np.median(rows)
    return clock.period(values)


def _breaks(values: NDArray, count_s: float) -> tuple[float | None, bool]:
    """Return the modulus of a clock that wraps around, if any, and whether it starts over."""
    runs = runs_of(values, count_s)
    step = clock.period(values)
    full = [
        clock.full_clock(values[before.rows[-1]], values[after.rows[0]], step, count_s)
        for before, after in itertools.pairwise(runs)
    ]
    # A register is full at the same reading each time; breaks that differ are restarts.
    if full and full[0] and len(set(full)) == 1:
        return full[0], False
    return None, len(runs) > 1


def runs_of(stamps: NDArray, count_s: float) -> list[clock.Run]:
    """Return the runs of a clock with these stamps (n,), whose counts last so long, s."""
    stamps = clock.whole(stamps) if stamps.dtype.kind in "iu" else stamps
    time_s = (stamps - clock.first_stamp(stamps)).astype(float) * count_s
    return clock.runs(time_s, stamps, count_s)
