"""What a file holds, as numbers: text that is none is told of, and counts as missing."""

import re

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.importing.finding import Finding, counted

LONGEST = 20
"""Letters of a text that a finding shows."""
THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d+)?")
"""A number with marks between its thousands."""
DAYS_FIRST = re.compile(r"^\s*(\d\d)\.(\d\d)\.(\d{4})")
TAKEN_FOR_MISSING = "taken for missing"
"""What is made of a text where a number should be."""


def numbers(values: NDArray, where: str, findings: list[Finding]) -> NDArray:
    """Return the values (n,) as float64, NaN where there is no number."""
    if values.dtype.kind in "biuf":
        return values.astype(float, copy=False)
    # As text: to pandas a date is a number of nanoseconds, and to nobody who named its column for
    # an angle.
    text = pd.Series(values.astype(str).astype(object) if values.dtype.kind in "mM" else values)
    if _have_thousands(text):
        findings.append(Finding(where, "commas between thousands", "read without them"))
        text = text.str.replace(",", "")
    found = pd.to_numeric(text, errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    words = np.isnan(found) & pd.notna(values)
    if words.any():
        row = int(np.argmax(words))
        seen = (
            f"{counted(int(words.sum()), 'row')} with text, the first"
            f" {str(values[row])[:LONGEST]!r} in row {row}"
        )
        findings.append(Finding(where, seen, TAKEN_FOR_MISSING))
    return found


def _have_thousands(text: pd.Series) -> bool:
    """Tell whether numbers have commas between their thousands: all texts with a comma are such,
    and one has a point.

    Without a point in one of them a comma may be a decimal one. What has no comma, a number or a
    word, says nothing.
    """
    written = text.dropna()
    if not pd.api.types.is_string_dtype(written):
        return False
    marked = written[written.str.contains(",", regex=False)]
    return bool(marked.str.contains(".", regex=False).any()) and bool(
        marked.str.fullmatch(THOUSANDS).all()
    )


def whole_nanoseconds(values: NDArray) -> NDArray:
    """Return dates written out, ``2026-01-31 12:00:00.125``, as nanoseconds (n,) int64; NaN where
    there is none.

    ``31.01.2026 12:00:00,125`` is such a date, too: with points between them, days come first
    everywhere. Times of day without a date are those of one day, and durations are since its
    beginning.
    """
    if values.dtype.kind in "iuf":
        return values
    if values.dtype.kind in "mM":
        whole = values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64)
        return np.where(np.isnat(values), np.nan, whole) if np.isnat(values).any() else whole
    text = pd.Series(values).astype("string")
    text = text.str.replace(DAYS_FIRST, r"\3-\2-\1", regex=True).str.replace(",", ".", regex=False)
    dates = pd.to_datetime(text, errors="coerce", format="ISO8601", utc=True)
    if dates.isna().all():
        dates = pd.to_datetime(
            "1970-01-01T" + text.astype("str"), errors="coerce", format="ISO8601", utc=True
        )
    stamps = dates.astype("datetime64[ns, UTC]").astype("int64")
    return (
        stamps.to_numpy()
        if dates.notna().all()
        else stamps.where(dates.notna()).to_numpy(dtype=float)
    )
