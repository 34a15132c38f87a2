"""The origin of a file: program, time, inputs and settings."""

import hashlib
import json
import platform
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pipelines import __version__
from pipelines.contracts import parquet
from pipelines.errors import ContractError


def describe(
    inputs: Iterable[Path] = (), config: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return the metadata that let a result be traced to its data and repeated.

    Parameters
    ----------
    inputs : iterable of Path
        The files this result was computed from. Never pass a sealed file of a rig: everyone can
        read its name and hash in the result.
    config : mapping, optional
        The stage's resolved settings, such as ``settings.model_dump(mode="json")``.

    Returns
    -------
    dict
        ``created_by``, ``created_at``, ``software``, ``inputs`` and ``config``, to be merged into a
        table's metadata.
    """
    return {
        "created_by": f"exoid {__version__}",
        "created_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "software": dict(_software()),
        "inputs": [{"name": Path(path).name, "sha256": sha256(path)} for path in inputs],
        "config": dict(config or {}),
    }


@cache
def _software() -> dict[str, str]:
    """Return the versions of Python and of the libraries that results depend on."""
    libraries = ("numpy", "scipy", "numba", "pandas", "pyarrow")
    return {"python": platform.python_version()} | {name: version(name) for name in libraries}


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, in hexadecimal."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def recording_behind(path: Path) -> str:
    """Return the SHA-256 of the recording behind a file.

    Parameters
    ----------
    path : Path
        A recording, or a ``motion/1`` table computed from one.

    Returns
    -------
    str
        Hexadecimal.

    Raises
    ------
    ContractError
        The file is damaged or of another program.
    """
    metadata = parquet.header(path)[1]
    # A motion has one input, its recording.
    if metadata["contract"].startswith("motion/") and metadata.get("inputs"):
        return str(metadata["inputs"][0]["sha256"])
    return sha256(path)


def provenance_of(path: Path) -> dict[str, Any]:
    """Return a table's metadata, or the ``provenance`` of a JSON document or an HTML page.

    Raises
    ------
    ContractError
        The file holds none that can be read.
    """
    if path.suffix not in (".json", ".html"):
        return parquet.header(path)[1]
    try:
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".html":
            # No text in this script contains `<`.
            script = r'<script type="application/json" id="made-of">([^<]*)</script>'
            return dict(json.loads(re.findall(script, text)[-1]))
        return dict(json.loads(text)["provenance"])
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise ContractError(f"{path}: has no record of its origin; make it again") from error


def metadata_of(path: Path) -> dict[str, Any]:
    """Return the same as ``provenance_of``; empty for a missing or unreadable file.

    For a caller that only needs to know which program made a file.
    """
    if path.is_file() and path.stat().st_size:
        with suppress(ContractError):
            return provenance_of(path)
    return {}
