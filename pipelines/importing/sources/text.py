"""Logs in text files: comma-separated values and all their relatives."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from pipelines.errors import InputError
from pipelines.importing.sources.dialect import Dialect, find_dialect
from pipelines.importing.sources.source import Columns, Source
from pipelines.settings.import_map import SourceSettings

BEYOND = "\0beyond"
"""A column after the last, in which nothing may stand."""
CHUNK = 2**17
"""Rows that are parsed at a time; the columns that nobody asked for are gone before the next."""


def open_text(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a text file, in the dialect that was found or told."""
    dialect = find_dialect(path, settings)
    return Source(
        path, "text", dialect.names, lambda names: _load(path, dialect, names), dialect.notes
    )


def _load(path: Path, dialect: Dialect, names: Sequence[str]) -> Columns:
    parts: list[Columns] = []
    wanted = list(dict.fromkeys(names))
    try:
        # All columns: told to read only some, pandas would not see that a row has too many.
        reader = pd.read_csv(
            path,
            sep=dialect.separator,
            decimal=dialect.decimal,
            comment=dialect.comment,
            header=None,
            names=[*dialect.names, BEYOND],
            skiprows=dialect.rows_before,
            encoding=dialect.encoding,
            encoding_errors="replace",
            chunksize=CHUNK,
            skipinitialspace=True,
            index_col=False,
            low_memory=False,
        )
        with reader:
            for part in reader:
                if part[BEYOND].notna().any():
                    raise InputError(
                        _too_many_fields(f"row {part[BEYOND].notna().idxmax()}", dialect)
                    )
                # Each column by itself: out of a table of thousands it takes long to take one.
                parts.append({name: part[name].to_numpy().copy() for name in wanted})
    except (pd.errors.ParserError, ValueError) as error:
        raise InputError(_why_not(str(error), dialect)) from error
    return {name: _joined([part.pop(name) for part in parts]) for name in wanted}


def _why_not(error: str, dialect: Dialect) -> str:
    """Say what pandas means."""
    if line := re.search(r"in line (\d+), saw", error):
        return _too_many_fields(f"line {line[1]}", dialect)
    if row := re.search(r"EOF inside string starting at row (\d+)", error):
        return (
            f"line {int(row[1]) + 1} opens a quotation mark that nothing closes; close it, or drop"
            " the line"
        )
    return f"cannot be read as text ({error}); export it anew"


def _too_many_fields(where: str, dialect: Dialect) -> str:
    return (
        f"{where} has more than the {len(dialect.names)} fields of the others, and nobody knows"
        " which is which; mend it, or say in the map's [source] how the file is written (read with"
        f" {dialect.in_words})"
    )


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """Return the chunks of a column in one; what was text in one of them is none in the others."""
    if len({part.dtype for part in parts}) > 1 and all(part.dtype != object for part in parts):
        return np.concatenate([part.astype(float) for part in parts])
    return np.concatenate(parts)
