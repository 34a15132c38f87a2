"""A recording made of a journal, whether its run has ended, was stopped or was killed; an hour
takes no more memory."""

import json
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.acquisition.recording.journal import (
    ABORT,
    FOUND,
    ROWS,
    JournalFile,
    field_of,
    in_pieces,
)
from pipelines.acquisition.recording.valid_rows import sound_batches
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import aborted_of
from pipelines.errors import ContractError

PIECE_ROWS = 32768
"""Samples that are held in memory at once."""
LARGEST = 1e9
"""Beyond this no rate, Hz, and no duration, s, is one."""


@dataclass(frozen=True)
class Account:
    """What a journal holds of its run, and what is missing."""

    samples: int
    planned: int
    """Samples that the run was to have."""
    rate_hz: float
    gaps: list[tuple[float, int]]
    """First missing time, s, and number of missing samples; what an early end left out is none."""
    abort: str | None
    """Why the run was stopped early, None if it was not."""
    found: dict[str, Any] = field(default_factory=dict)
    """What else the run found out for its metadata."""
    damaged: bool = False
    """Whether the journal holds less than was written into it, or bytes that tell nothing."""
    checked: bool = True
    """Whether each sample was held against a checksum."""

    @property
    def missed(self) -> int:
        """Samples missing in gaps."""
        return sum(count for _, count in self.gaps)

    @property
    def cut_off(self) -> int:
        """Samples missing at the end."""
        return self.planned - self.samples - self.missed


def account_of(journal: JournalFile) -> Account:
    """Go through a journal and say what is there; the device's counter tells what is not."""
    _refuse_other_columns(journal)
    rate_hz = _positive(journal, "sample_rate_hz")
    seconds = _positive(journal, "config", "run", "duration_s")
    planned, samples, reached = round(seconds * rate_hz), 0, 0
    gaps, offset, last_words = list[tuple[float, int]](), None, None
    for batch in sound_batches(journal):
        last_words = batch.last_words
        if not batch.rows.num_rows:
            continue
        sequence = batch.rows.column("sequence").to_numpy()
        if offset is None:
            offset = round(batch.rows.column("time_s")[0].as_py() * rate_hz) - sequence[0]
        index = sequence + offset
        metadata, samples = (
            _gaps(np.concatenate([[reached - 1], index]), rate_hz),
            samples + len(index),
        )
        gaps, reached = gaps + metadata, int(index[-1]) + 1
    ending = None if last_words is None else _ending_of(last_words)
    if ending is None:
        # A full disk takes the last words with it: nobody can tell the two apart.
        why = (
            f"ended {reached / rate_hz:.3f} s into {seconds:g} s without a word: killed, or its"
            " disk was full"
        )
        damaged = journal.damaged > 0 or last_words is not None
        why += ", or its last words are damaged" if damaged else ""
        return Account(
            samples, planned, rate_hz, gaps, why, damaged=damaged, checked=journal.checked
        )
    abort, found_out, rows = ending
    if not abort:
        gaps = gaps + _gaps(np.array([reached - 1, planned]), rate_hz)
    damaged = journal.damaged > 0 or rows != journal.rows
    return Account(samples, planned, rate_hz, gaps, abort, found_out, damaged, journal.checked)


def _ending_of(last_words: dict[bytes, bytes]) -> tuple[str | None, dict[str, Any], int] | None:
    """Return why a run stopped early, what else it found out, and its number of samples; None where
    that is damaged."""
    try:
        metadata = json.loads(last_words[FOUND])
        ending = last_words[ABORT].decode() or None, metadata, int(last_words[ROWS])
    except (KeyError, ValueError):
        return None
    return ending if isinstance(metadata, dict) else None


def _refuse_other_columns(journal: JournalFile) -> None:
    """Refuse a journal whose columns are none of a run's."""
    fields = {field.name: field for field in journal.schema}
    for name in ("time_s", "sequence", *fields):
        stored, expected = fields.get(name), field_of(name)
        if stored is None or stored.type != expected.type:
            fault = "is missing" if stored is None else f"holds {stored.type}"
            raise ContractError(
                f"{journal.path}: its column {name} {fault}, expected {expected.type}; exoid wrote"
                " no such journal, nothing was changed"
            )


def _positive(journal: JournalFile, *keys: str) -> float:
    """Return a number of a journal's metadata that a recording cannot be made without."""
    value: Any = journal.metadata
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 < value <= LARGEST:
        return value
    fault = "is missing" if value is None else f"is {value!r:.40}"
    raise ContractError(
        f"{journal.path}: {'.'.join(keys)} of its metadata {fault}, expected a number above 0 and"
        f" up to {LARGEST:g}; exoid wrote no such journal, nothing was changed"
    )


def _gaps(index: np.ndarray, rate_hz: float) -> list[tuple[float, int]]:
    """Return what is missing between samples whose numbers (n,) count from the run's beginning."""
    before = np.flatnonzero(np.diff(index) > 1)
    return [((int(index[k]) + 1) / rate_hz, int(index[k + 1] - index[k]) - 1) for k in before]


def write_recording(journal: JournalFile, path: Path, account: Account, **more: Any) -> None:
    """Write what a journal holds as ``recording/1``; ``more`` goes into its metadata."""
    abort = {"abort": account.abort} if account.abort else {}
    unchecked = {} if account.checked else {"unchecked": True}
    metadata = journal.metadata | account.found | {"gaps": account.gaps} | abort | unchecked | more
    rows = (batch.rows for batch in sound_batches(journal))
    RECORDING.write_pieces(path, in_pieces(rows, PIECE_ROWS), metadata)


def place_for(output: Path, abort: str | None) -> Path:
    """Return the name of a recording: of a stopped run one beside the output that is not taken.

    So nobody, make included, takes what a run left for all that it was to bring.
    """
    if not abort:
        return output
    return next(path for number in count(1) if not (path := aborted_of(output, number)).exists())
