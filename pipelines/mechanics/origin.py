"""Where a run came from, and so where what is wrong with it is put right: in a rig file, or in an
import's map."""

from collections.abc import Sequence

from pipelines.mechanics.run import Run


def settings_of(run: Run) -> str:
    """Say which file tells how a run's channels are read: a map where it was imported, else the
    rig's."""
    return "the map" if "imported" in run.metadata else "the rig file"


def giving(purpose: str, runs: Sequence[Run]) -> str:
    """Say how a session comes by a run for a purpose."""
    if any("imported" in run.metadata for run in runs):
        return (
            f'give one of them purpose = "{purpose}" in a [[recording]] of the map and import again'
        )
    return "record one with `exoid acquire`, or set `purpose` in a recording's metadata"
