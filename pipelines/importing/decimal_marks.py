"""Numbers in text with a decimal comma, or with marks between their thousands."""

import re

import pandas as pd


def as_written(column: pd.Series, decimal: str) -> pd.Series:
    """Return a column of a text file whose numbers have a decimal point.

    Text stays text. pandas leaves a whole column as it is written if one of its cells is no number.

    Parameters
    ----------
    column : (n,) Series
        Numbers, or text.
    decimal : str
        Decimal point of the file.
    """
    if decimal == "." or column.dtype.kind in "biuf":
        return column
    texts = column.astype(object)
    if have_thousands(texts, ","):
        texts = texts.str.replace(r"\.(?=\d{3})", "", regex=True)
    comma = r"^(\s*[-+]?\d*),(\d*(?:[eE][-+]?\d+)?\s*)$"
    return texts.str.replace(comma, r"\1.\2", regex=True)


def have_thousands(texts: pd.Series, decimal: str) -> bool:
    """Return whether numbers have marks between their thousands: commas, or points.

    All numbers with such a mark must be of this kind, and one of them must have a decimal point.
    Without it the mark may be a decimal one.
    """
    mark = "," if decimal == "." else "."
    digits = r"[-+\d.,]+"
    thousands = rf"[+-]?[1-9]\d{{0,2}}(?:{re.escape(mark)}\d{{3}})+(?:{re.escape(decimal)}\d+)?"
    marked = pd.Series(
        [text for text in texts if isinstance(text, str) and mark in text], dtype=str
    )
    marked = marked[marked.str.fullmatch(digits)]
    return bool(marked.str.contains(decimal, regex=False).any()) and bool(
        marked.str.fullmatch(thousands).all()
    )
