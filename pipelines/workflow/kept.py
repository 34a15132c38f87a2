"""Recordings of real legs: making one anew moves somebody, and what it replaces is lost."""

from pathlib import Path

from pipelines.contracts.provenance import told_by
from pipelines.errors import InputError


def refuse_recorded(path: Path) -> None:
    """Refuse to record over what a rig recorded that is not embedded; a virtual leg can be moved
    again."""
    rig = told_by(path).get("config", {}).get("rig", {})
    if rig and not rig["embedded"]:
        raise InputError(
            f"{path}: is a recording of the rig {rig['name']}, not overwritten; --overwrite"
            " replaces it, -o writes another file"
        )
