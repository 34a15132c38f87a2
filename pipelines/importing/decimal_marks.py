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

    All numbers with such a mark must be of this kind. One of them must have a decimal point, too,
    or the mark stand in each number from 1000 on, and in none below.
    """
    mark = "," if decimal == "." else "."
    digits = r"[-+\d.,]+"
    thousands = rf"[+-]?[1-9]\d{{0,2}}(?:{re.escape(mark)}\d{{3}})+(?:{re.escape(decimal)}\d+)?"
    marked = pd.Series(
        [text for text in texts if isinstance(text, str) and mark in text], dtype=str
    )
    marked = marked[marked.str.fullmatch(digits)]
    if marked.empty or not marked.str.fullmatch(thousands).all():
        return False
    return bool(marked.str.contains(decimal, regex=False).any()) or _stand_from_1000_on(
        len(marked), [str(one).strip() for one in texts if pd.notna(one) and mark not in str(one)]
    )


def _stand_from_1000_on(marked: int, others: list[str]) -> bool:
    """Return whether the marks stand in the numbers from 1000 on alone.

    Many numbers have them, and as many others are whole and below 1000. A logger that writes a
    decimal mark writes it in nearly all numbers, and in those below 1, too.
    """
    # Numbers of each kind that are no coincidence.
    enough = 10
    plain = [text for text in others if re.fullmatch(r"[-+]?\d+([.,]\d*)?", text)]
    return (
        marked >= enough
        and len(plain) >= enough
        and all(re.fullmatch(r"[-+]?\d{1,3}", text) for text in plain)
    )
