"""Describe any exoid file: its contract, its origin and its content."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from pipelines.contracts import checks, contract_of, parquet
from pipelines.errors import ContractError
from pipelines.validation.toml import read_toml


@dataclass(frozen=True)
class Inspection:
    """The description of one file."""

    file: str
    contract: str
    purpose: str
    origin: dict[str, Any] = field(default_factory=dict)
    metadata: dict[str, Any] = field(default_factory=dict)
    rows: int = 0
    columns: list[dict[str, Any]] = field(default_factory=list)
    """Keys: column, unit, type, min and max (None for text), nulls (with NaN) and meaning."""
    fault: ContractError | None = None
    """The first breach of the contract; None if there is none."""

    def as_json(self) -> dict[str, Any]:
        """Return the description for programs."""
        return vars(self) | {"fault": str(self.fault) if self.fault else None}


def inspect(path: Path) -> Inspection:
    """Describe a Parquet file, a JSON document or a TOML trajectory by its content.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    Inspection
        With ``fault`` set if the file breaks its contract.

    Raises
    ------
    ContractError
        The file cannot be read.
    """
    if path.suffix == ".parquet":
        return _table(path)
    return _document(path) or _trajectory_toml(path) or _table(path)


def _table(path: Path) -> Inspection:
    contract = contract_of(path)
    schema, metadata = parquet.header(path)
    # Without checks: a table that breaks its contract is to be described as well. And not
    # schema.empty_table(), for which Arrow imports pandas.
    empty = pa.Table.from_batches([], schema)
    table = pa.concat_tables([empty, *parquet.pieces(path)])
    fault = None
    try:
        contract.load(path)
    except ContractError as error:
        fault = error
    origin, rest = _origin_and_rest(metadata)
    return Inspection(
        file=str(path),
        contract=metadata["contract"],
        purpose=contract.purpose,
        origin=origin,
        metadata={key: rest[key] for key in rest if key != "contract"},
        rows=table.num_rows,
        columns=[_column(table, name) for name in dict.fromkeys(table.column_names)],
        fault=fault,
    )


def _column(table: pa.Table, name: str) -> dict[str, Any]:
    # By position: a foreign file may have a name twice, which Arrow refuses to look up.
    index = table.column_names.index(name)
    column, about = table.column(index), table.schema.field(index).metadata or {}
    low, high, missing = None, None, column.null_count
    if pa.types.is_floating(column.type):
        # NaN counts as missing, like null, and is no minimum.
        missing += pc.sum(pc.is_nan(column)).as_py() or 0
    is_ordered = not (pa.types.is_nested(column.type) or checks.is_text(column.type))
    if is_ordered and missing < len(column):
        low, high = pc.min_max(column).as_py().values()
    return {
        "column": name,
        "unit": about.get(b"unit", b"").decode(),
        "type": checks.type_name(column.type),
        "min": low,
        "max": high,
        "nulls": missing,
        "meaning": about.get(b"meaning", b"").decode(),
    }


def _document(path: Path) -> Inspection | None:
    from pipelines.contracts import verdict  # its many models take time to build

    # Only a file that calls itself JSON is refused for a fault of its text.
    is_json = path.suffix == ".json" and path.is_file()
    content = verdict.parsed(path) if is_json else _parsed(path, verdict.parsed)
    # JSON documents, for people and programs without Parquet, and their purposes.
    documents = {
        "verdict/1": "the answer of `exoid diagnose`",
        "model/1": "a model, as `exoid export --to json` writes it",
        "detectability/1": "the smallest detectable size of each cause",
    }
    if not isinstance(content, dict) or content.get("contract") not in documents:
        return None
    fault = None
    if content["contract"] == "verdict/1":
        try:
            verdict.check(content, str(path))
        except ContractError as error:
            fault = error
    contract, provenance = content.pop("contract"), content.pop("provenance", {})
    origin, rest = _origin_and_rest(provenance)
    return Inspection(str(path), contract, documents[contract], origin, content | rest, fault=fault)


def _origin_and_rest(metadata: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Split metadata into those that say where a file comes from, and the others."""
    names = ("created_by", "created_at", "software", "inputs", "config")
    origin = {name: metadata[name] for name in names if name in metadata}
    return origin, {name: metadata[name] for name in metadata if name not in origin}


def _trajectory_toml(path: Path) -> Inspection | None:
    content = _parsed(path, read_toml)
    if not {"a", "b", "omega_rad_s"} <= content.keys():
        return None
    return Inspection(
        str(path), "trajectory as TOML", "Fourier coefficients of an excitation", {}, content
    )


def _parsed(path: Path, read: Callable[[Path], Any]) -> dict[str, Any]:
    """Return the file's content; an empty object for another kind of file."""
    try:
        content = read(path)
    except (ContractError, ValueError, FileNotFoundError, IsADirectoryError):
        return {}  # its own reader reports the error
    return content if isinstance(content, dict) else {}
