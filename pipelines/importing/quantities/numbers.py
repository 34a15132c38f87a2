"""A file's values as numbers; text that is no number is reported, and counts as missing."""

import re

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.importing.decimal_marks import have_thousands
from pipelines.importing.finding import Note, counted, unnoted

TAKEN_FOR_MISSING = "taken for missing"
"""Treatment of a text where a number should be."""


def numbers(values: NDArray, note: Note = unnoted) -> NDArray:
    """Return values as numbers.

    Parameters
    ----------
    values : (n,) array
        Values as the file has them.
    note : callable
        Takes what is reported about text.

    Returns
    -------
    (n,) array of float64
        NaN where there is no number.
    """
    # Greatest length of a text in a finding.
    longest = 20
    if values.dtype.kind in "biuf":
        return values.astype(float, copy=False)
    # As text, because pandas would convert dates to nanoseconds. A date in a column for an angle is
    # no number.
    text = pd.Series(values.astype(str).astype(object) if values.dtype.kind in "mM" else values)
    if have_thousands(text, "."):
        note("commas between thousands", "read without them")
        text = text.map(lambda one: one.replace(",", "") if isinstance(one, str) else one)
    result = pd.to_numeric(text, errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    words = np.isnan(result) & pd.notna(values)
    if words.any():
        row = int(np.argmax(words))
        seen = (
            f"{counted(int(words.sum()), 'row')} with text, the first"
            f" {str(values[row])[:longest]!r} in row {row}"
        )
        note(seen, TAKEN_FOR_MISSING)
    return result


def same_stamps(one: NDArray, other: NDArray) -> bool:
    """Return whether two clocks (n,) have equal stamps, where text counts as missing."""
    if pd.Series(one).equals(pd.Series(other)):
        return True
    if len(one) != len(other) or "M" in one.dtype.kind + other.dtype.kind:
        return False
    numeric = numbers(one)
    return bool(np.isfinite(numeric).any()) and np.array_equal(
        numeric, numbers(other), equal_nan=True
    )


def whole_nanoseconds(values: NDArray, written: str | None = None) -> NDArray:
    """Return dates such as ``2026-01-31 12:00:00.125`` as nanoseconds since 1970.

    In ``31.01.2026 12:00:00,125`` the day comes first, as points separate the parts. With slashes,
    the dates show whether it does: no month is above 12, and midnight adds a day. Times of day
    without a date are those of 1 January 1970, as are minutes and seconds such as ``59:58.125``.

    Parameters
    ----------
    values : (n,) array
        Dates, durations, times of day, or numbers, which are returned as they are.
    written : str, optional
        How dates are written, as in ``datetime.strptime``.

    Returns
    -------
    (n,) array of int64
        Nanoseconds; float64 with NaN where some are no dates.
    """
    if values.dtype.kind in "iuf" and written is None:
        return values
    if values.dtype.kind in "mM":
        whole = values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64)
        missing = np.isnat(values)
        return np.where(missing, np.nan, whole) if missing.any() else whole
    text = pd.Series(values).astype("string").str.strip()
    if written is not None:
        return _nanoseconds(pd.to_datetime(text, errors="coerce", format=written, utc=True))
    # ISO 8601 has the year first. It allows a comma before the fraction, which becomes a point.
    text = text.str.replace(r"^(\d\d)\.(\d\d)\.(\d{4})", r"\3-\2-\1", regex=True)
    text = text.str.replace(r"\s*(?:UTC|GMT)$", "Z", regex=True).str.replace(",", ".", regex=False)
    # In UTC, so that stamps with different offsets can be compared, as across a change to summer
    # time.
    dates = pd.to_datetime(text, errors="coerce", format="ISO8601", utc=True)
    # Times of day alone: any date does, because only differences of stamps count.
    if dates.isna().all():
        dates = pd.to_datetime(
            "1970-01-01T" + text.astype("str"), errors="coerce", format="ISO8601", utc=True
        )
    if dates.isna().all():
        dates = _minutes(text)
    return _nanoseconds(_in_other_words(text) if dates.isna().all() else dates)


def frames_in_a_second(values: NDArray) -> int | None:
    """Return how many frames a time code counts in each second; None if it is no time code.

    Hours, minutes, seconds and frames, as 10:15:01:24, look like hundredths of a second. Their last
    two digits start over before they come to 99, and leave the rest of each second empty.

    Parameters
    ----------
    values : (n,) array
        Stamps as the file has them.
    """
    # Seconds that start over by chance, and the share of hundredths below which they are frames:
    # cameras have up to 72 frames a second.
    by_chance, full = 2, 90
    if values.dtype.kind in "iufmM":
        return None
    parts = pd.Series(values).astype("string").str.extract(r"\d:(\d\d)[:;.](\d\d)\s*$").dropna()
    seconds, frames = (parts[k].astype(int).to_numpy() for k in (0, 1))
    if len(parts) < 0.99 * len(values):
        return None
    # Several rows may have one frame.
    new = (np.diff(seconds) != 0) | (np.diff(frames) != 0)
    starts, steps = np.diff(seconds)[new] != 0, np.diff(frames)[new]
    if np.count_nonzero(starts) <= by_chance or not np.any(~starts):
        return None
    step = int(np.median(steps[~starts]))
    count = int(frames.max()) + step
    goes_on = np.mean(steps[~starts] == step) > 0.9
    starts_over = np.mean(steps[starts] == step - count) > 0.9
    return count if step > 0 and count < full and goes_on and starts_over else None


def have_minutes(degrees: NDArray) -> bool:
    """Return whether decimals of degrees (n,) are minutes, as in 12.5930 for 12° 59' 30".

    They then never reach .60, although a motion that passes many degrees comes to all decimals.
    """
    # Whole degrees that are passed, and hundredths that occur: decimals of coarse steps are few.
    passed, many = 10, 30
    size = np.abs(degrees[np.isfinite(degrees)])
    # Hundredths of an outlier may be above all integers of 64 bits.
    size = size[size < 2.0**40]
    # A decimal fraction lies next to its float, on either side.
    hundredths = np.floor(100.0 * size + 1e-6).astype(np.int64)
    whole, parts = np.divmod(hundredths, 100)
    return bool(
        np.count_nonzero(np.diff(whole)) >= passed
        and parts.max() < 60
        and len(np.unique(parts)) >= many
    )


def _minutes(text: pd.Series) -> pd.Series:
    """Return minutes and seconds (n,) as dates; without a fraction they may be hours."""
    parts = text.str.extract(r"^(\d{1,4}):([0-5]\d\.\d{1,9})$").astype("string")
    since = pd.to_timedelta("00:00:" + parts[1], errors="coerce")
    since += pd.to_timedelta(pd.to_numeric(parts[0]).astype(float), unit="min")
    return pd.Timestamp("1970-01-01", tz="UTC") + since


def _nanoseconds(dates: pd.Series) -> NDArray:
    """Return dates (n,) as nanoseconds since 1970."""
    stamps = dates.astype("datetime64[ns, UTC]").astype("int64")
    # Integers where none is missing: at 1.7e18 ns since 1970, neighbours in float64 are 256 ns
    # apart.
    if dates.notna().all():
        return stamps.to_numpy()
    return stamps.where(dates.notna()).to_numpy(dtype=float)


_OTHER_WORDS = re.compile(
    r"^(?:(?P<one>\d{1,4})(?P<mark>[/.-])(?P<two>\d{1,2})[/.-](?P<three>\d{1,4})[T\s]+)?"
    r"(?P<hour>\d{1,2}):(?P<minute>\d\d)(?::(?P<second>\d\d)(?:[.:](?P<fraction>\d{1,9}))?)?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?P<zone>Z|[+-]\d\d:?\d\d)?$"
)
"""Dates with slashes, and times of day with AM or PM, or a colon before their milliseconds."""


def _in_other_words(text: pd.Series) -> pd.Series:
    """Return dates (n,) that are not of ISO 8601; missing where day and month may be exchanged."""
    parts = text.str.extract(_OTHER_WORDS).astype("string")
    afternoon = parts["half"].str.lower().str.startswith("p").fillna(False)
    hour = pd.to_numeric(parts["hour"])
    hour = hour.where(parts["half"].isna(), hour % 12 + 12 * afternoon.astype(int))
    clock = hour.astype("string").str.zfill(2) + ":" + parts["minute"]
    clock += ":" + parts["second"].fillna("00") + "." + parts["fraction"].fillna("0")
    clock += parts["zone"].fillna("Z")

    def dates(*order: str) -> pd.Series:
        year, month, day = (parts[name].str.zfill(2) for name in order)
        days = year.where(year.str.len() == 4, "20" + year) + "-" + month + "-" + day
        stamps = days.fillna("1970-01-01") + "T" + clock
        return pd.to_datetime(stamps, errors="coerce", format="ISO8601", utc=True)

    if (parts["one"].str.len() == 4).any():
        return dates("one", "two", "three")
    day_first = dates("three", "two", "one")
    if (parts["mark"] == ".").any():
        return day_first
    return _likelier(day_first, dates("three", "one", "two"))


def _likelier(one: pd.Series, other: pd.Series) -> pd.Series:
    """Return the readings (n,) of dates that are dates, and follow each other; else missing ones.

    A month above 12 is no date. Across midnight, the wrong reading goes on by a month.
    """
    day = pd.Timedelta(days=1)
    missing = [int(dates.isna().sum()) for dates in (one, other)]
    if missing[0] != missing[1]:
        return one if missing[0] < missing[1] else other
    steps = [dates.diff().dropna() for dates in (one, other)]
    if steps[0].equals(steps[1]):
        return one
    follow = [bool((step.abs() < day).all()) for step in steps]
    if follow[0] != follow[1]:
        return one if follow[0] else other
    return one.mask(one.notna())


def are_whole(values: NDArray) -> bool:
    """Return whether values are whole numbers, with at most 1 % of exceptions.

    Parameters
    ----------
    values : (n,) array
        NaN is left out.
    """
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool(np.mean(known == np.round(known)) > 0.99)
