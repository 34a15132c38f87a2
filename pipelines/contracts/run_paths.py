"""Where a run keeps its samples until its recording is whole, and after it was stopped early."""

from pathlib import Path

JOURNAL = ".journal"
"""Ending of the journal's name, after the recording's name."""


def journal_of(output: Path) -> Path:
    """Return the path of a recording's journal."""
    return output.with_name(output.name + JOURNAL)


def aborted_of(output: Path, number: int = 1) -> Path:
    """Return the path of a recording that was stopped early, which make must not take for whole."""
    suffix = "" if number == 1 else f"-{number}"
    return output.with_name(f"{output.stem}.aborted{suffix}{output.suffix}")
