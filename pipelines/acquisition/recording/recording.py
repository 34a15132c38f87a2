"""A recording made of the journal of a run that has ended, was stopped or was killed.

It is made in pieces, so that a long run takes no more memory than a short one.
"""

import json
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.acquisition.recording.journal import ABORT, METADATA, ROWS
from pipelines.acquisition.recording.journal_file import JournalFile, in_pieces
from pipelines.acquisition.recording.valid_rows import valid_batches
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import aborted_of
from pipelines.errors import ContractError


@dataclass(frozen=True)
class JournalSummary:
    """The samples of a journal, and those that are missing."""

    samples: int
    planned: int
    """Samples that the run should have had."""
    rate_hz: float
    gaps: list[tuple[float, int]]
    """First missing time, s, and number of missing samples, without those after an early end."""
    abort: str | None
    """Why the run was stopped early, None if it was not."""
    metadata: dict[str, Any]
    """Metadata that were not known before the run."""
    damaged: bool
    """Whether samples that were written are missing, or bytes have no meaning."""

    @property
    def missed(self) -> int:
        """Samples missing in gaps."""
        return sum(count for _, count in self.gaps)

    @property
    def cut_off(self) -> int:
        """Samples missing at the end."""
        return self.planned - self.samples - self.missed


def summarize(journal: JournalFile) -> JournalSummary:
    """Count a journal's samples, and those that are missing according to the device's counter.

    Parameters
    ----------
    journal : JournalFile
        The journal of one run.

    Returns
    -------
    JournalSummary
        Samples, gaps (time in s and number), and why the run ended.

    Raises
    ------
    ContractError
        The journal's metadata or columns are not those of a run.
    """
    rate_hz, seconds = _rate_and_duration(journal)
    planned, samples, reached = round(seconds * rate_hz), 0, 0
    gaps = list[tuple[float, int]]()
    offset, last_words = None, None
    for batch in valid_batches(journal):
        last_words = batch.last_words
        if not batch.rows.num_rows:
            continue
        sequence = batch.rows.column("sequence").to_numpy()
        if offset is None:
            # Time 0 is where the recording begins, even if its first samples are missing.
            offset = round(batch.rows.column("time_s")[0].as_py() * rate_hz) - sequence[0]
        index = sequence + offset
        # With the last sample of the batch before, as a gap may lie between the two.
        gaps += _gaps(np.concatenate([[reached - 1], index]), rate_hz)
        samples += len(index)
        reached = int(index[-1]) + 1
    damaged = journal.damaged > 0
    if last_words is None:
        # Neither a killed run nor one on a full disk can write its last words.
        abort = (
            f"ended {reached / rate_hz:.3f} s into {seconds:g} s without a word: killed, or its"
            f" disk was full{', or its last words are damaged' if damaged else ''}"
        )
        return JournalSummary(samples, planned, rate_hz, gaps, abort, {}, damaged)
    abort = last_words[ABORT].decode()
    if not abort:
        # After an early end the rest of the plan is no gap.
        gaps += _gaps(np.array([reached - 1, planned]), rate_hz)
    metadata = json.loads(last_words[METADATA])
    damaged |= int(last_words[ROWS]) != journal.rows
    return JournalSummary(samples, planned, rate_hz, gaps, abort or None, metadata, damaged)


def _rate_and_duration(journal: JournalFile) -> tuple[float, float]:
    """Return the samples a second and the planned seconds; refuse what no run has written."""
    try:
        rate_hz = float(journal.metadata["sample_rate_hz"])
        seconds = float(journal.metadata["config"]["run"]["duration_s"])
    except (KeyError, TypeError, ValueError):
        rate_hz = seconds = 0.0
    largest = 1e9  # credible rate, Hz, and duration, s
    is_of_a_run = 0.0 < rate_hz <= largest and 0.0 < seconds <= largest
    if not is_of_a_run or not {"time_s", "sequence"} <= set(journal.schema.names):
        raise ContractError(
            f"{journal.path}: columns or metadata are not those of a run; nothing was changed"
        )
    return rate_hz, seconds


def _gaps(index: np.ndarray, rate_hz: float) -> list[tuple[float, int]]:
    """Return time (s) and length of each gap between samples numbered (n,) from the run's start."""
    before = np.flatnonzero(np.diff(index) > 1)
    return [((int(index[k]) + 1) / rate_hz, int(index[k + 1] - index[k]) - 1) for k in before]


def write_recording(journal: JournalFile, path: Path, summary: JournalSummary, **more: Any) -> None:
    """Write a journal's samples as ``recording/1``.

    Parameters
    ----------
    journal : JournalFile
        The journal of one run.
    path : Path
        The file to write.
    summary : JournalSummary
        Of the same journal.
    **more
        Further metadata.
    """
    # Samples that are held in memory at once.
    piece_rows = 32768
    metadata = journal.metadata | summary.metadata | {"gaps": summary.gaps}
    if summary.abort:
        metadata["abort"] = summary.abort
    metadata |= more
    rows = (batch.rows for batch in valid_batches(journal))
    RECORDING.write_pieces(path, in_pieces(rows, piece_rows), metadata)


def recording_path(output: Path, abort: str | None) -> Path:
    """Return the path of a recording.

    So that no one, make included, takes the recording of a stopped run for a complete one.

    Parameters
    ----------
    output : Path
        Path of a complete recording.
    abort : str or None
        Why the run was stopped, if it was.

    Returns
    -------
    Path
        For a stopped run the first free ``.aborted`` name.
    """
    if not abort:
        return output
    names = (aborted_of(output, number) for number in count(1))
    return next(path for path in names if not path.exists())
