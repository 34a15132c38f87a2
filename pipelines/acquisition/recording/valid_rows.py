"""The rows of a journal that a recording may hold; the others are left out as gaps."""

from collections.abc import Collection, Iterator

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipelines.acquisition.modbus.wraparound import keeps_time
from pipelines.acquisition.recording.journal_file import Batch, JournalFile
from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.contracts.joints import joints_of


def valid_batches(journal: JournalFile) -> Iterator[Batch]:
    """Yield a journal's batches without rows of impossible values or with a wrong counter or clock.

    Each row is compared with the last valid one, so that one damaged row does not cost the next.
    """
    rate_hz, last = journal.metadata["sample_rate_hz"], None
    if journal.metadata.get("recording_only"):
        # Its rows were compared with this computer's clock as they came. Their times are those of
        # the answers, which on a slow line come more than half a sample late.
        rate_hz = None
    turning = {joint.name for joint in joints_of(journal.metadata) if joint.turns}
    for batch in journal.batches():
        possible = _are_possible(batch.rows, turning)
        is_valid, last = _in_time(batch.rows, possible, rate_hz, last)
        if is_valid.all():
            yield batch
        else:
            yield Batch(batch.rows.filter(pa.array(is_valid)), batch.last_words)


def _are_possible(rows: pa.RecordBatch, turning: Collection[str]) -> NDArray:
    """Mark the rows (n,) that have only values which a recording may hold.

    Angles of the ``turning`` joints may be of any number of turns.
    """
    # Endings of the columns that hold a number in every row.
    always_measured = ("_angle_rad", "_torque_nm")
    possible = np.ones(rows.num_rows, bool)
    for name, column in zip(rows.schema.names, rows.columns, strict=True):
        values = column.to_numpy(zero_copy_only=False)
        if name.endswith(always_measured) or name == "time_s":
            possible &= np.isfinite(values)
        else:
            # NaN is a value that was not measured, as a force between two readings.
            possible &= ~np.isinf(values)
        has_limit = name.removesuffix("_angle_rad").removesuffix("_reference_rad") not in turning
        if name.endswith("_rad") and has_limit:
            possible &= ~(np.abs(values) > LARGEST_ANGLE_RAD)
    return possible


def _in_time(
    rows: pa.RecordBatch, possible: NDArray, rate_hz: float | None, last: tuple[int, float] | None
) -> tuple[NDArray, tuple[int, float] | None]:
    """Mark the ``possible`` rows (n,) that follow the last valid one in counter and clock.

    Without a rate, both only have to increase. Return them and the new last valid row's (sequence,
    time in s).
    """
    is_valid = possible.copy()
    sequence, time = (rows.column(name).to_numpy() for name in ("sequence", "time_s"))
    for k in np.flatnonzero(possible):
        current = int(sequence[k]), float(time[k])
        if last is not None:
            samples, seconds = current[0] - last[0], current[1] - last[1]
            is_valid[k] = samples > 0 and seconds > 0.0
            is_valid[k] &= rate_hz is None or keeps_time(samples, seconds, rate_hz)
        if is_valid[k]:
            last = current
    return is_valid, last
