"""What a run that did not end as it should leaves beside the place of its recording."""

from pathlib import Path

JOURNAL = ".journal"
"""Ending of a recording that is still being made."""


def journal_of(output: Path) -> Path:
    """Return where the journal of a recording lies while it is being made."""
    return output.with_name(output.name + JOURNAL)


def aborted_of(output: Path, number: int = 1) -> Path:
    """Return where the recording of a run that was stopped early lies: so nobody, make included,
    takes it for whole."""
    return output.with_name(
        f"{output.stem}.aborted{'' if number == 1 else f'-{number}'}{output.suffix}"
    )
