"""Logs in text files, such as comma-separated values."""

import re
from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipelines.errors import InputError
from pipelines.importing.decimal_marks import as_written
from pipelines.importing.sources.dialect import Dialect, find_dialect
from pipelines.importing.sources.source import Columns, Source
from pipelines.settings.import_map import SourceSettings


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
    return _source(path, "text", dialect, lambda: path)


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
        lambda names: _load(content(), dialect, names),
        dialect.notes,
        units=dialect.units,
        clocks=dialect.clocks,
        remarks=(dialect.remark,) if dialect.remark else (),
    )


def _load(content: Any, dialect: Dialect, names: Sequence[str]) -> Columns:
    # A column after the last, which must be empty.
    beyond = "\0beyond"
    # Rows that are parsed at a time, to keep only the columns that are needed.
    chunk = 2**17
    parts: list[Columns] = []
    wanted = list(dict.fromkeys(names))
    try:
        # All columns are read, as otherwise pandas would not report rows with too many fields.
        reader = pd.read_csv(
            content,
            sep=dialect.separator,
            decimal=dialect.decimal,
            comment=dialect.comment,
            header=None,
            names=[*dialect.names, beyond],
            skiprows=dialect.rows_before,
            encoding=dialect.encoding,
            encoding_errors="replace",
            chunksize=chunk,
            skipinitialspace=True,
            # Otherwise pandas takes the first columns for an index where rows have more fields than
            # names.
            index_col=False,
            low_memory=False,
        )
        with reader:
            for part in reader:
                excess = part[beyond].notna()
                if excess.any():
                    raise InputError(_too_many_fields(f"row {excess.idxmax()}", dialect))
                part = part[wanted].apply(lambda column: as_written(column, dialect.decimal))
                _refuse_second_table(part, dialect)
                # Copies, as slicing one column from a table of thousands is slow later on.
                parts.append({name: part[name].to_numpy().copy() for name in wanted})
    except (pd.errors.ParserError, ValueError) as error:
        raise InputError(_parse_error(str(error), dialect)) from error
    # Removed from the chunks as they are joined, so that no column is in memory twice for long.
    return {name: _joined([part.pop(name) for part in parts]) for name in wanted}


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
