"""Logs in Parquet."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from pipelines.errors import InputError
from pipelines.importing.sources.flatten import leaves_of, nested_source
from pipelines.importing.sources.source import Columns, Source
from pipelines.settings.base import repeated
from pipelines.settings.import_map import SourceSettings


def open_parquet(path: Path, settings: SourceSettings) -> Source:
    """Return the log in a Parquet file.

    Fields of a struct have dotted names, elements of a list numbered ones.

    Raises
    ------
    InputError
        If the file is damaged, or two of its columns have one name.
    """
    schema = _opened(path).schema_arrow
    _refuse_twins(schema.names)
    empty = _unnested(schema.empty_table())
    _refuse_twins(empty.column_names)
    # Columns of a list are numbered by its length, which only the values show.
    if any(pa.types.is_nested(field.type) for field in empty.schema):
        with _damage_reported():
            leaves = leaves_of(_opened(path).read().to_pydict())
        return nested_source(path, "Parquet", leaves)

    def load(names: Sequence[str]) -> Columns:
        file = _opened(path)
        tops = [
            top
            for top in file.schema_arrow.names
            if any(f"{name}.".startswith(f"{top}.") for name in names)
        ]
        with _damage_reported():
            table = _unnested(file.read(columns=tops))
        return {name: _numpy(table.column(name)) for name in names}

    return Source(path, "Parquet", tuple(empty.column_names), load)


def _opened(path: Path) -> pq.ParquetFile:
    with _damage_reported():
        return pq.ParquetFile(path)


@contextmanager
def _damage_reported() -> Iterator[None]:
    """Raise one error for all that the library raises for a damaged file."""
    try:
        yield
    except (pa.ArrowException, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise  # from the system: no permission, no such file
        raise InputError(
            f"is a damaged or truncated Parquet file ({error}); copy it again"
        ) from error


def _refuse_twins(names: Sequence[str]) -> None:
    for name in repeated(names):
        raise InputError(f"has two columns {name!r}; rename one and write the file again")


def _unnested(table: pa.Table) -> pa.Table:
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    return table


def _numpy(column: pa.ChunkedArray) -> NDArray:
    """Return a column's values; dates and durations in nanoseconds."""
    if pa.types.is_timestamp(column.type):
        column = column.cast(pa.timestamp("ns", column.type.tz))
    elif pa.types.is_duration(column.type):
        column = column.cast(pa.duration("ns"))
    return column.to_numpy()
