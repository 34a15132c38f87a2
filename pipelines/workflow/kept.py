"""Recordings of real legs: making one anew moves somebody, and what it replaces is lost."""

from contextlib import suppress
from pathlib import Path
from typing import Any

from pipelines.contracts.provenance import provenance_of
from pipelines.errors import ContractError, InputError


def refuse_recorded(path: Path) -> None:
    """Refuse to record over what a rig recorded that is not embedded; a virtual leg can be moved again."""
    rig = _rig_of(path)
    if rig and not rig["embedded"]:
        raise InputError(
            f"{path}: is a recording of the rig {rig['name']}, not overwritten; --overwrite replaces it, -o writes "
            "another file"
        )


def _rig_of(path: Path) -> dict[str, Any]:
    """Return the rig of a recording as it tells it; nothing where it tells none."""
    if path.is_file() and path.stat().st_size:
        with suppress(ContractError):  # whoever reads or replaces it says what is wrong with it
            return provenance_of(path).get("config", {}).get("rig", {})
    return {}
