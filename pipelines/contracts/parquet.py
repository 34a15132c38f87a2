"""Parquet files with exoid's metadata: opened with a clear refusal, written whole or not at all."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from pipelines.contracts.atomic import whole_file
from pipelines.errors import ContractError

KEY = b"exoid"


def load(path: Path) -> tuple[pa.Table, dict[str, Any]]:
    """Return a file's table and its ``exoid`` metadata, or say why it is none of exoid's."""
    _refuse_what_is_no_file(path)
    try:
        # Not read_table(path): it would take a folder named "run=1" above the file for a column of a data set.
        table = pq.ParquetFile(path).read()
    except (pa.ArrowException, UnicodeDecodeError) as error:
        raise ContractError(f"{path}: {_what_is_wrong_with_the_bytes(path)}") from error
    return table, _metadata(table, path)


def save(path: Path, table: pa.Table, metadata: Mapping[str, Any]) -> None:
    """Write a table and its metadata under ``path``, atomically."""
    if path.is_dir():
        raise ContractError(f"{path}: is a folder, expected the name of a Parquet file to write")
    text = to_json(metadata, str(path))
    with whole_file(path) as temporary:
        pq.write_table(table.replace_schema_metadata({KEY: text.encode()}), temporary, compression="zstd")


def to_json(metadata: Mapping[str, Any], source: str) -> str:
    """Return metadata as JSON text; NumPy's numbers and arrays become plain ones, paths become text."""
    try:
        return json.dumps(dict(metadata), ensure_ascii=False, allow_nan=False, default=_plain)
    except (TypeError, ValueError) as error:
        raise ContractError(
            f"{source}: metadata cannot be written as JSON ({error}); use finite numbers, text, lists and objects"
        ) from error


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"found {type(value).__name__}")


def _refuse_what_is_no_file(path: Path) -> None:
    if not path.exists():
        raise ContractError(f"{path}: no such file; check the name, or make it first")
    if path.is_dir():
        raise ContractError(f"{path}: is a folder, expected a Parquet file; name a file in it")
    if path.stat().st_size == 0:
        raise ContractError(f"{path}: is empty (0 bytes), expected a Parquet file; copy or make it again")


def _what_is_wrong_with_the_bytes(path: Path) -> str:
    with open(path, "rb") as file:
        start = file.read(4)
    if start == b"PAR1":
        return "is a damaged or truncated Parquet file; copy or make it again"
    return f"is not a Parquet file (it starts with {start!r}, expected b'PAR1'); name a file that exoid wrote"


def _metadata(table: pa.Table, path: Path) -> dict[str, Any]:
    text = (table.schema.metadata or {}).get(KEY)
    if text is None:
        raise ContractError(
            f"{path}: has no `exoid` entry in its schema metadata; add one with at least "
            '{"contract": "<name>/<version>"}, see docs/contracts.md'
        )
    try:
        metadata = json.loads(text)
    except ValueError as error:
        raise ContractError(f"{path}: its `exoid` metadata is not JSON ({error}); write it again") from error
    if not isinstance(metadata, dict) or not isinstance(metadata.get("contract"), str):
        raise ContractError(
            f'{path}: its `exoid` metadata names no contract; it must hold at least {{"contract": "<name>/<version>"}}'
        )
    return metadata
