"""Logs in text files, such as comma-separated values."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from pipelines.errors import InputError
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
    dialect = find_dialect(path, settings)
    return Source(
        path, "text", dialect.names, lambda names: _load(path, dialect, names), dialect.notes
    )


def _load(path: Path, dialect: Dialect, names: Sequence[str]) -> Columns:
    # A column after the last, which must be empty.
    beyond = "\0beyond"
    # Rows that are parsed at a time, to keep only the columns that are needed.
    chunk = 2**17
    parts: list[Columns] = []
    wanted = list(dict.fromkeys(names))
    try:
        # All columns are read, as otherwise pandas would not report rows with too many fields.
        reader = pd.read_csv(
            path,
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
                # Copies, as slicing one column from a table of thousands is slow later on.
                parts.append({name: part[name].to_numpy().copy() for name in wanted})
    except (pd.errors.ParserError, ValueError) as error:
        raise InputError(_parse_error(str(error), dialect)) from error
    # Removed from the chunks as they are joined, so that no column is in memory twice for long.
    return {name: _joined([part.pop(name) for part in parts]) for name in wanted}


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
