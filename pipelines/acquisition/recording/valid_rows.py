"""Rows of a journal that can stand in a recording; what cannot is left out, so that it never costs
the others."""

from collections.abc import Iterator

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipelines.acquisition.modbus.wraparound import keeps_time
from pipelines.acquisition.recording.journal import Batch, JournalFile
from pipelines.contracts.checks import LARGEST_ANGLE_RAD

MEASURED = ("_angle_rad", "_torque_nm")
"""How the names of columns end that hold a number in every row."""


def sound_batches(journal: JournalFile) -> Iterator[Batch]:
    """Yield a journal's batches without rows whose values are none, or whose counter and clock
    part.

    Each row is held against the last one that was sound: a single row that is damaged is left out,
    and the next one goes on.
    """
    rate_hz, last = journal.metadata["sample_rate_hz"], None
    for batch in journal.batches():
        kept, last = _in_time(batch.rows, _are_numbers(batch.rows), rate_hz, last)
        whole = bool(kept.all())
        yield batch if whole else Batch(batch.rows.filter(pa.array(kept)), batch.last_words)


def _are_numbers(rows: pa.RecordBatch) -> NDArray:
    """Mark the rows (n,) all of whose values a recording may hold."""
    fine = np.ones(rows.num_rows, bool)
    for name, column in zip(rows.schema.names, rows.columns, strict=True):
        values = column.to_numpy(zero_copy_only=False)
        fine &= (
            np.isfinite(values)
            if name.endswith(MEASURED) or name == "time_s"
            else ~np.isinf(values)
        )
        if name.endswith("_rad"):
            fine &= ~(np.abs(values) > LARGEST_ANGLE_RAD)
    return fine


def _in_time(
    rows: pa.RecordBatch, fine: NDArray, rate_hz: float, last: tuple[int, float] | None
) -> tuple[NDArray, tuple[int, float] | None]:
    """Mark those of the ``fine`` rows (n,) that go on from the last one; return the new last one
    too."""
    kept = fine.copy()
    sequence, time = (rows.column(name).to_numpy() for name in ("sequence", "time_s"))
    for k in np.flatnonzero(fine):
        instant = int(sequence[k]), float(time[k])
        if last is not None:
            samples, seconds = instant[0] - last[0], instant[1] - last[1]
            kept[k] = samples > 0 and seconds > 0.0 and keeps_time(samples, seconds, rate_hz)
        if kept[k]:
            last = instant
    return kept, last
