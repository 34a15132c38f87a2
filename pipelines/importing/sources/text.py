"""Logs in text files, such as comma-separated values."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.errors import InputError
from pipelines.importing.decimal_marks import as_written
from pipelines.importing.sources.dialect import Dialect, find_dialect, is_value
from pipelines.importing.sources.source import Columns, Source
from pipelines.importing.sources.stated import comments_between
from pipelines.settings.import_map import SourceSettings

BEYOND = "\0beyond"
"""A column after the last, which must be empty."""


def open_text(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a text file, in a dialect that is derived as far as it is not given.

    Raises
    ------
    InputError
        The file holds no table of numbers.
    """
    # Bytes and lines at the beginning of a file from which its dialect is derived.
    looked_at, lines = 2**16, 50
    with open(path, "rb") as file:
        start = file.read(looked_at)
        # Thousands of columns fill many bytes with a line.
        while start.count(b"\n") < lines and (more := file.read(looked_at)):
            start += more
        whole = not file.read(1)
    dialect = find_dialect(start, whole, settings)
    between = comments_between(path, dialect.comment, dialect.encoding, dialect.rows_before)
    return _source(path, "text", replace(dialect, stated=dialect.stated + between), lambda: path)


def open_lines(path: Path, format: str, text: str, settings: SourceSettings) -> Source:
    """Return the log in text that was made of the cells of another format.

    Raises
    ------
    InputError
        The text holds no table of numbers.
    """
    content = text.encode()
    dialect = find_dialect(content, True, settings)
    return _source(path, format, dialect, lambda: BytesIO(content))


def _source(path: Path, format: str, dialect: Dialect, content: Callable[[], Any]) -> Source:
    return Source(
        path,
        format,
        dialect.names,
        lambda names: _load(content, dialect, names),
        dialect.notes,
        units=dialect.units,
        clocks=dialect.clocks,
        scaling=dialect.scaling,
        fields_above=dialect.fields_above,
        stated=dialect.stated,
        remarks=(dialect.remark,) if dialect.remark else (),
    )


def _load(content: Callable[[], Any], dialect: Dialect, names: Sequence[str]) -> Columns:
    parts: list[Columns] = []
    wanted = list(dict.fromkeys(names))
    ends = list(dialect.names[dialect.width - 1 :])
    have_short = False
    try:
        # All columns are read, as otherwise pandas would not report rows with too many fields.
        with _reader(content(), dialect) as reader:
            for part in reader:
                excess = part[BEYOND].notna()
                if excess.any():
                    raise InputError(_too_many_fields(f"row {excess.idxmax()}", dialect))
                have_short |= bool(part[ends].isna().to_numpy().any())
                part = part[wanted].apply(lambda column: as_written(column, dialect.decimal))
                _refuse_second_table(part, dialect)
                # Copies, as slicing one column from a table of thousands is slow later on.
                parts.append({name: part[name].to_numpy().copy() for name in wanted})
    except (pd.errors.ParserError, ValueError) as error:
        raise InputError(_parse_error(str(error), dialect)) from error
    # Removed from the chunks as they are joined, so that no column is in memory twice for long.
    columns = {name: _joined([part.pop(name) for part in parts]) for name in wanted}
    if have_short and dialect.delimiter == " ":
        short, uncertain = _short_rows(content(), dialect, ends)
        if short.any():
            for name in uncertain & columns.keys():
                columns[name] = _blanked(columns[name], short)
    return columns


def _reader(content: Any, dialect: Dialect, **settings: Any) -> Any:
    """Return a reader of a text's rows, in chunks, of which all columns need not be kept."""
    # Rows that are parsed at a time.
    chunk = 2**17
    return pd.read_csv(
        content,
        sep=dialect.separator,
        decimal=dialect.decimal,
        comment=dialect.comment,
        header=None,
        names=[*dialect.names, BEYOND],
        skiprows=dialect.rows_before,
        encoding=dialect.encoding,
        encoding_errors="replace",
        chunksize=chunk,
        skipinitialspace=True,
        # Otherwise pandas takes the first columns for an index where rows have more fields than
        # names.
        index_col=False,
        low_memory=False,
        **settings,
    )


def _short_rows(
    content: Any, dialect: Dialect, ends: Sequence[str]
) -> tuple[NDArray, frozenset[str]]:
    """Return which rows end before the last column of numbers, one of ``ends``.

    Such a row lacks a field, which may be any of them: spaces do not show where a blank is.

    Returns
    -------
    (n,) array of bool, frozenset of str
        The rows; and the columns whose values in them are uncertain.
    """
    written: list[NDArray] = []
    numeric: list[NDArray] = []
    # Columns from the left that are in order in short rows, too, as a clock is: none lacks a field.
    intact = len(dialect.names)
    last: dict[str, float] = {}
    with _reader(content, dialect, dtype=str, keep_default_na=False) as reader:
        for part in reader:
            texts = part[ends].fillna("")
            written.append((texts != "").to_numpy())
            numeric.append(texts.map(lambda text: is_value(text, dialect.decimal)).to_numpy())
            for k, name in enumerate(dialect.names[:intact]):
                if not _in_order(as_written(part[name], dialect.decimal), name, last):
                    intact = k
                    break
    has, counts = np.concatenate(written), np.concatenate(numeric).sum(axis=0)
    # A last column of words is often blank, and a number missing before it leaves a word there.
    of_numbers = np.flatnonzero(2 * counts > has.sum(axis=0))
    short = ~has[:, of_numbers[-1]] if of_numbers.size else np.zeros(len(has), dtype=bool)
    return short, frozenset(dialect.names[intact:])


def _in_order(texts: pd.Series, name: str, last: dict[str, float]) -> bool:
    """Return whether texts (n,) are dates, or numbers that never decrease from the last before."""
    date = r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}|\d{1,4}(:\d{2}){1,2}([.,]\d+)?"
    if texts.str.fullmatch(date).all():
        return True
    values = pd.to_numeric(texts, errors="coerce").to_numpy(dtype=float)
    before = last.get(name, -np.inf)
    last[name] = values[-1]
    return bool((values >= np.append(before, values[:-1])).all())


def _blanked(values: NDArray, rows: NDArray) -> NDArray:
    """Return values (n,) that are missing at some rows (n,)."""
    # Stamps in nanoseconds since 1970 have more digits than float64.
    exact = values.dtype.kind == "f" or (
        values.dtype.kind in "iu" and bool((np.abs(values.astype(float)) < 2.0**53).all())
    )
    result = values.astype(float if exact else object)
    result[rows] = np.nan
    return result


def _refuse_second_table(part: pd.DataFrame, dialect: Dialect) -> None:
    """Raise InputError at a row of words under which other columns begin."""
    numeric = [name for name in part if name in dialect.numeric]
    if sum(part[name].dtype.kind == "O" for name in numeric) < 2:
        return
    known = part[numeric].notna().to_numpy()
    words = known & part[numeric].apply(pd.to_numeric, errors="coerce").isna().to_numpy()
    # All that the row has are words, and the next row has as many fields.
    heads = (words == known).all(axis=1) & (words.sum(axis=1) > 1)
    heads[:-1] &= (known[1:] == known[:-1]).all(axis=1)
    places = {name: k for k, name in enumerate(dialect.names)}
    for row in np.flatnonzero(heads):
        texts = {name: str(part[name].iloc[row]).strip() for name in numeric}
        # Words that differ, as the same word in all columns marks a fault.
        given = [text for text, word in zip(texts.values(), words[row], strict=True) if word]
        again = all(
            places[name] < len(dialect.heads) and text in dialect.heads[places[name]]
            for (name, text), word in zip(texts.items(), words[row], strict=True)
            if word
        )
        if len(set(given)) == len(given) and not again:
            raise InputError(
                f"holds a second table from row {part.index.to_numpy()[row]} on, under"
                f" {', '.join(given)[:60]!r}; save each as a file of its own"
            )


def _parse_error(error: str, dialect: Dialect) -> str:
    """Return pandas' error in plain words."""
    line = re.search(r"in line (\d+), saw", error)
    if line:
        return _too_many_fields(f"line {line[1]}", dialect)
    row = re.search(r"EOF inside string starting at row (\d+)", error)
    if row:
        return f"line {int(row[1]) + 1} has an unclosed quotation mark; close it, or drop the line"
    return f"cannot be read as text ({error}); export it again"


def _too_many_fields(where: str, dialect: Dialect) -> str:
    return (
        f"{where} has more than the {len(dialect.names)} fields of the others (read with"
        f" {dialect.in_words}); correct it, or describe the file in the map's [source]"
    )


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """Return the chunks of a column as one; where one has text, all keep their objects."""
    if len({part.dtype for part in parts}) > 1 and all(part.dtype != object for part in parts):
        return np.concatenate([part.astype(float) for part in parts])
    return np.concatenate(parts)
