"""Parquet files with exoid's metadata: read piece by piece, written whole or not at all."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import chain
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from pipelines.contracts.atomic import refuse_special, whole_file
from pipelines.contracts.equality import KEY, MAGIC
from pipelines.errors import ContractError
from pipelines.validation.suggestion import similar_file

ROWS = 2**16
"""Rows of a piece that is read and of a row group that is written, some 20 MB of a recording."""


def header(path: Path) -> tuple[pa.Schema, dict[str, Any]]:
    """Return a file's columns and its ``exoid`` metadata.

    Parameters
    ----------
    path : Path
        A Parquet file.

    Returns
    -------
    tuple
        Arrow schema and metadata.

    Raises
    ------
    ContractError
        The file is damaged or of another program.
    """
    with _opened(path) as file:
        return file.schema_arrow, _metadata(file.schema_arrow, path)


def is_whole(path: Path) -> bool:
    """Return whether a file is a complete Parquet file; its rows are not read."""
    try:
        with _opened(path):
            return True
    except ContractError:
        return False


def pieces(path: Path, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
    """Yield the rows of a file piece by piece.

    Parameters
    ----------
    path : Path
        A Parquet file.
    columns : sequence of str, optional
        Names of columns; all by default.

    Yields
    ------
    pyarrow.Table
        At most ``ROWS`` rows.

    Raises
    ------
    ContractError
        The file is damaged.
    """
    with _opened(path) as file:
        # Group by group, because Arrow's reader of several keeps all that it has read in memory.
        for group in range(file.num_row_groups):
            for batch in file.iter_batches(ROWS, row_groups=[group], columns=columns):
                yield pa.Table.from_batches([batch])


@contextmanager
def _opened(path: Path) -> Iterator[pq.ParquetFile]:
    _refuse_unreadable(path)
    try:
        # Not read_table(path), which takes a parent folder named "run=1" for a column. Without a
        # size of the buffer, Arrow reads ahead the whole row group of each column.
        with pq.ParquetFile(path, buffer_size=2**20) as file:
            yield file
    except (pa.ArrowException, UnicodeDecodeError, OSError) as error:
        if isinstance(error, OSError) and error.errno:
            # The system's refusal; Arrow's OSError for a damaged page has no number.
            raise
        raise ContractError(f"{path}: {_fault_of_bytes(path)}") from error


def save(path: Path, pieces: Iterable[pa.Table], metadata: Mapping[str, Any]) -> None:
    """Write a table that comes in pieces, atomically.

    Parameters
    ----------
    path : Path
        A name that ends in .parquet.
    pieces : iterable of pyarrow.Table
        At least one, all with the same columns.
    metadata : mapping
        With the key ``contract``.

    Raises
    ------
    ContractError
        ``path`` holds another kind of table, or has another suffix.
    """
    pieces = iter(pieces)
    first = next(pieces)  # an error in it is raised before a folder or file is created
    refuse_place(path, metadata["contract"])
    schema = first.schema.with_metadata({KEY: to_json(metadata, str(path)).encode()})
    with whole_file(path) as temporary:
        temporary.touch()  # the system's error, if any, is clearer than Arrow's
        with pq.ParquetWriter(temporary, schema, compression="zstd") as writer:
            for piece in chain([first], pieces):
                described = piece.replace_schema_metadata(schema.metadata)
                writer.write_table(described, row_group_size=ROWS)


def refuse_place(path: Path, contract: str) -> None:
    """Refuse to write over a folder or over a table of another contract.

    A recording cannot be made again. Names must end in .parquet, or ``*.parquet`` misses them.

    Parameters
    ----------
    path : Path
        The file to write.
    contract : str
        Name and version, such as ``recording/1``.

    Raises
    ------
    ContractError
        Names the path and its present content.
    """
    if path.is_dir():
        raise ContractError(f"{path}: is a folder, expected the name of a Parquet file to write")
    refuse_special(path)
    if path.suffix != ".parquet":
        raise ContractError(
            f"{path}: expected a name that ends in .parquet, which is what is written; name another"
        )
    # An empty file has nothing that could be lost.
    if not path.exists() or path.stat().st_size == 0:
        return
    try:
        schema = pq.ParquetFile(path).schema_arrow
        present = "a table of another program"
        if KEY in (schema.metadata or {}):
            present = _metadata(schema, path)["contract"]
    except (pa.ArrowException, UnicodeDecodeError):
        if _start(path) == MAGIC:
            return  # a truncated table may be replaced
        present = "no Parquet table"
    # Another version of the same contract may be replaced.
    if present.partition("/")[0] != contract.partition("/")[0]:
        raise ContractError(
            f"{path}: holds {present}, not overwritten with {contract}; choose another name or"
            " remove it"
        )


def to_json(metadata: Mapping[str, Any], source: str) -> str:
    """Return metadata as JSON text, with NumPy's values and paths in JSON's types.

    Raises
    ------
    ContractError
        If a value has no JSON form.
    """
    try:
        return json.dumps(dict(metadata), ensure_ascii=False, allow_nan=False, default=_plain)
    except (TypeError, ValueError) as error:
        raise ContractError(
            f"{source}: metadata cannot be written as JSON ({error}); use finite numbers, text,"
            " lists and objects"
        ) from error


def _plain(value: Any) -> Any:
    # Arrays and scalars of NumPy.
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"found {type(value).__name__}")


def _refuse_unreadable(path: Path) -> None:
    if not path.exists():
        raise ContractError(
            f"{path}: no such file; {similar_file(path) or 'check the name, or make it first'}"
        )
    if path.is_dir():
        raise ContractError(f"{path}: is a folder, expected a Parquet file; name a file in it")
    if path.stat().st_size == 0:
        raise ContractError(
            f"{path}: is empty (0 bytes), expected a Parquet file; copy or make it again"
        )


def _fault_of_bytes(path: Path) -> str:
    start = _start(path)
    # An Arrow stream begins so; a journal's name may have been changed.
    if start == b"\xff\xff\xff\xff":
        return (
            f"is the journal of a run that was killed or still goes on, with {_whole_rows(path)}"
            f" whole samples; `exoid recover {path}` makes a recording of it"
        )
    if start != MAGIC:
        return (
            f"is not a Parquet file (it starts with {start!r}, expected {MAGIC!r}); name a file"
            " that exoid wrote"
        )
    return "is a damaged or truncated Parquet file; copy or make it again"


def _whole_rows(path: Path) -> int:
    rows = 0
    # The stream may be cut off; the rows before the cut are whole.
    with suppress(pa.ArrowException, OSError), open(path, "rb") as file:
        for batch in pa.ipc.open_stream(file):
            rows += batch.num_rows
    return rows


def _start(path: Path) -> bytes:
    with open(path, "rb") as file:
        return file.read(len(MAGIC))


def _metadata(schema: pa.Schema, path: Path) -> dict[str, Any]:
    text = (schema.metadata or {}).get(KEY)
    if text is None:
        raise ContractError(
            f"{path}: has no `exoid` entry in its schema metadata, so exoid did not write it;"
            ' `exoid import` makes a recording of a log; for a table of your own add {"contract":'
            ' "<name>/<version>"}, see docs/contracts.md'
        )
    try:
        metadata = json.loads(text)
    except ValueError as error:
        raise ContractError(
            f"{path}: its `exoid` metadata is not JSON ({error}); write it again"
        ) from error
    if not isinstance(metadata, dict) or not isinstance(metadata.get("contract"), str):
        raise ContractError(
            f'{path}: its `exoid` metadata names no contract; it must hold at least {{"contract":'
            ' "<name>/<version>"}'
        )
    return metadata
