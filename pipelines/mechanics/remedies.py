"""What to change so that a run is right: in the rig file, or in the map of its import."""

from collections.abc import Sequence

from pipelines.mechanics.run import Run

AT_REST = (
    'for a joint that rests in all runs set drive = "unmeasured" if its angle matters, or leave it'
    " out"
)
"""What to do about a joint that rests in all runs."""


def settings_of(run: Run) -> str:
    """Return the file that describes a run's channels: the map of its import, or the rig file."""
    return "the map" if "imported" in run.metadata else "the rig file"


def how_to_correct(run: Run, key: str) -> str:
    """Return how to correct a channel: the key of the map of its import, or the rig file."""
    if "imported" in run.metadata:
        return f"change its `{key}` in the map"
    return "correct its register in the rig file"


def remedy_for_repeats(run: Run) -> str:
    """Explain how to leave out values that a drive gave again."""
    if "imported" in run.metadata:
        return 'set `keep = "new"` in the map\'s [time] and import again'
    return "wait for new data before reading"


def how_to_add(purpose: str, runs: Sequence[Run]) -> str:
    """Explain how to add a run for a purpose to a session."""
    if any("imported" in run.metadata for run in runs):
        return (
            f'give one of them purpose = "{purpose}" in a [[recording]] of the map and import again'
        )
    return "record one with `exoid acquire`, or set `purpose` in a recording's metadata"
