"""What any exoid file is, where it came from, and what is in it, without knowing beforehand."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from pipelines.contracts import checks, contract_of, parquet, verdict
from pipelines.errors import ContractError
from pipelines.validation.toml import read_toml

ORIGIN = ("created_by", "created_at", "software", "inputs", "config")


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
    """Each with column, unit, type, min and max (None for text), nulls (NaN among them) and
    meaning."""
    fault: ContractError | None = None
    """Why the file does not keep its contract, if so."""

    def as_json(self) -> dict[str, Any]:
        """Return the description for programs."""
        fault = str(self.fault) if self.fault else None
        return {
            **{key: value for key, value in vars(self).items() if key != "fault"},
            "fault": fault,
        }


def inspect(path: Path) -> Inspection:
    """Describe a Parquet file of exoid's, one of its JSON documents, or a trajectory as TOML, by
    its content."""
    for reader in (_document, _trajectory_toml):
        found = reader(path)
        if found:
            return found
    return _table(path)


def _table(path: Path) -> Inspection:
    contract = contract_of(path)
    table, metadata = parquet.load(path)
    fault = None
    try:
        contract.read(path)
    except ContractError as error:
        fault = error
    return Inspection(
        file=str(path),
        contract=metadata["contract"],
        purpose=contract.purpose,
        origin={key: metadata[key] for key in ORIGIN if key in metadata},
        metadata={
            key: value for key, value in metadata.items() if key not in (*ORIGIN, "contract")
        },
        rows=table.num_rows,
        columns=[_column(table, name) for name in dict.fromkeys(table.column_names)],
        fault=fault,
    )


def _column(table: pa.Table, name: str) -> dict[str, Any]:
    index = table.column_names.index(name)
    column, about = table.column(index), table.schema.field(index).metadata or {}
    low, high = None, None
    if pa.types.is_floating(column.type):
        # No number is no value, however it is written.
        column = pc.if_else(pc.is_nan(column), None, column)
    if not (pa.types.is_nested(column.type) or checks.is_text(column.type)):
        low, high = pc.min_max(column).as_py().values()
    return {
        "column": name,
        "unit": about.get(b"unit", b"").decode(),
        "type": checks.type_name(column.type),
        "min": low,
        "max": high,
        "nulls": column.null_count,
        "meaning": about.get(b"meaning", b"").decode(),
    }


DOCUMENTS = {
    "verdict/1": "the answer of `exoid diagnose`",
    "model/1": "a model, as `exoid export --to json` writes it",
    "detectability/1": "the smallest size of each cause that would be seen",
}
"""What is written as JSON, for people and programs that have no Parquet."""


def _document(path: Path) -> Inspection | None:
    content = (
        verdict.parsed(path)
        if path.suffix == ".json" and path.is_file()
        else _parsed(path, _read_json)
    )
    if not isinstance(content, dict) or content.get("contract") not in DOCUMENTS:
        return None
    fault = _fault_of(content, path)
    contract, provenance = content.pop("contract"), content.pop("provenance", {})
    origin = {key: provenance.pop(key) for key in ORIGIN if key in provenance}
    return Inspection(
        str(path), contract, DOCUMENTS[contract], origin, content | provenance, fault=fault
    )


def _fault_of(content: dict[str, Any], path: Path) -> ContractError | None:
    try:
        if content["contract"] == "verdict/1":
            verdict.check(content, str(path))
    except ContractError as error:
        return error
    return None


def _trajectory_toml(path: Path) -> Inspection | None:
    content = _parsed(path, read_toml)
    if not {"a", "b", "omega_rad_s"} <= content.keys():
        return None
    return Inspection(
        str(path), "trajectory as TOML", "Fourier coefficients of an excitation", {}, content
    )


def _read_json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def _parsed(path: Path, read: Callable[[Path], Any]) -> dict[str, Any]:
    """Return the file's content as an object, empty where it is none."""
    try:
        content = read(path)
    except (ValueError, FileNotFoundError, IsADirectoryError):
        return {}  # some other kind of file; its own reader says what is wrong with it
    return content if isinstance(content, dict) else {}
