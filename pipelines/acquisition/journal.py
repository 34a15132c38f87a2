"""Every sample on disk as it comes: an Arrow stream beside the recording, readable wherever it was cut off.

Whoever writes a journal holds a lock on it, which the system takes away whatever becomes of the process: so a run
that goes on can be told from one that was killed.
"""

import fcntl
import io
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import pyarrow as pa

from pipelines.contracts.parquet import KEY, to_json
from pipelines.errors import ContractError, InputError

FLUSH_S = 0.2
"""Longest a sample waits before it is written, s; a crash loses no more."""
ENDING = ".journal"
ABORT = b"abort"
"""Key under which a journal's last words say why the run was stopped early; empty where it was not."""
FOUND = b"found"
"""Key under which they hold what the run found out for its metadata."""


def journal_of(output: Path) -> Path:
    """Return where the journal of a recording lies while it is being made."""
    return output.with_name(output.name + ENDING)


class Journal:
    """Rows on their way to disk."""

    def __init__(self, path: Path, columns: Sequence[str], metadata: dict[str, Any]) -> None:
        self.path = path
        self.rows = 0
        fields = [pa.field(name, pa.int64() if name == "sequence" else pa.float64()) for name in columns]
        self._schema = pa.schema(fields, metadata={KEY: to_json(metadata, str(path)).encode()})
        self._waiting: list[Sequence[float]] = []
        self._flushed = time.monotonic()
        self._last_words: dict[bytes, str] | None = None
        path.parent.mkdir(parents=True, exist_ok=True)
        # Exclusive: a journal that is there already is all that is left of a run.
        self._file = open(path, "xb", buffering=0)  # noqa: SIM115, it stays open from the first sample to the last
        fcntl.flock(self._file, fcntl.LOCK_EX)
        self._bytes = io.BytesIO()
        self._stream = pa.ipc.new_stream(self._bytes, self._schema)
        self._stream.write_batch(self._batch([]))  # the head comes to disk with a first batch only
        self._hand_over()

    def append(self, row: Sequence[float]) -> None:
        """Add a sample."""
        self._waiting.append(row)
        self.rows += 1
        if time.monotonic() - self._flushed >= FLUSH_S:
            self.flush()

    def flush(self) -> None:
        """Hand what waits over to the operating system."""
        if self._waiting:
            self._stream.write_batch(self._batch(self._waiting))
            self._hand_over()
            self._waiting = []
        self._flushed = time.monotonic()

    def end(self, abort: str | None, found: Mapping[str, Any] | None = None) -> None:
        """Say how the run ended: why it was stopped early, None if it was not. Only a killed run never says.

        ``found`` is what else its metadata shall tell that was not known before the run.
        """
        self._last_words = {ABORT: abort or "", FOUND: json.dumps(found or {})}

    def close(self) -> None:
        """Write the rest and close the file."""
        with self._file:  # closed even where the disk is full
            self.flush()
            if self._last_words is not None:
                self._stream.write_batch(self._batch([]), custom_metadata=self._last_words)
            self._stream.close()
            self._hand_over()

    def _batch(self, rows: Sequence[Sequence[float]]) -> pa.RecordBatch:
        columns = zip(*rows, strict=True) if rows else ((),) * len(self._schema)
        arrays = [pa.array(column, type=field.type) for column, field in zip(columns, self._schema, strict=True)]
        return pa.record_batch(arrays, schema=self._schema)

    def _hand_over(self) -> None:
        """Write what the stream has made; all of it or, where the disk is full, nothing."""
        whole, left = self._file.tell(), memoryview(self._bytes.getvalue())
        self._bytes.seek(0)
        self._bytes.truncate()
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError:
            # After half a batch nothing could be read that comes later.
            self._file.truncate(whole)
            self._file.seek(whole)
            raise

    def __enter__(self) -> Self:
        """Return the journal; it is closed at the end of the block."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close()
        if kind and not self.rows:
            self.path.unlink()  # nothing is lost, and nothing stands in the way of the next run


@dataclass(frozen=True)
class Batch:
    """Some rows of a journal, and the last words of the run where they are its end."""

    rows: pa.RecordBatch
    last_words: dict[bytes, bytes] | None


class JournalFile:
    """A journal as it is found, whole or cut off anywhere; it is read batch by batch."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with open(path, "rb") as file:
                self.schema = pa.ipc.open_stream(file).schema
            self.metadata: dict[str, Any] = json.loads(self.schema.metadata[KEY])
        except (pa.ArrowException, KeyError, TypeError, ValueError) as error:
            raise ContractError(
                f"{path}: is no journal of a run, or not even its head was written and so no sample; delete it"
            ) from error

    def batches(self) -> Iterator[Batch]:
        """Yield batch after batch; the one that was cut off is none."""
        with open(self.path, "rb") as file:
            stream = pa.ipc.open_stream(file)
            while True:
                try:
                    rows, words = stream.read_next_batch_with_custom_metadata()
                except (StopIteration, pa.ArrowException, OSError):  # the end, or where it was cut off
                    return
                yield Batch(rows, None if words is None else dict(words))

    def pieces(self, rows: int) -> Iterator[pa.Table]:
        """Yield all samples as tables of about so many rows."""
        waiting, count = [], 0
        for batch in self.batches():
            waiting.append(batch.rows)
            count += batch.rows.num_rows
            if count >= rows:
                yield pa.Table.from_batches(waiting)
                waiting, count = [], 0
        if waiting:
            yield pa.Table.from_batches(waiting)


@contextmanager
def locked(path: Path) -> Iterator[bool]:
    """Hold a journal's lock; yields False where another process holds it, which is recording then."""
    with open(path, "rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            free = True
        except BlockingIOError:
            free = False
        yield free


def refuse_leftover(path: Path) -> None:
    """Refuse to record over what another run writes or has left."""
    if not path.exists():
        return
    with locked(path) as free:
        if not free:
            raise InputError(f"{path}: another run is recording there now; choose another output or wait for its end")
    try:
        journal = JournalFile(path)
    except ContractError as error:
        raise InputError(f"{path}: holds no sample of a run that was killed; delete it") from error
    rows = sum(batch.rows.num_rows for batch in journal.batches())
    raise InputError(
        f"{path}: holds {rows} samples of a run {journal.metadata['run']} that was killed; `exoid recover {path}` "
        "makes a recording of them; or delete it"
    )
