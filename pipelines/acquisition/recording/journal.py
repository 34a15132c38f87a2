"""The journal of a run: every sample on disk as it comes, readable if it is cut off or damaged.

It is an Arrow stream next to the recording. Its writer holds a lock on it, which the system
releases when the process ends or is killed: so a run that goes on can be distinguished from one
that was killed.
"""

import errno
import io
import json
import os
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import pyarrow as pa

from pipelines.acquisition.modbus.file_lock import take
from pipelines.acquisition.recording import checksum, header_copy
from pipelines.contracts.equality import KEY
from pipelines.contracts.parquet import to_json

FLUSH_S = 0.2
"""Longest a sample waits before it is written, s; a crash loses no more."""
MOST_WAITING = 20_000
"""Most samples that wait for a disk which does not answer, 20 s at 1 kHz; then the run stops."""
ABORT = b"abort"
"""Key in a journal's last words of why the run was stopped early; empty where it was not."""
METADATA = b"found"
"""Key of metadata that were not known before the run."""
ROWS = b"rows"
"""Key of the number of samples."""
END = b"\xff\xff\xff\xff\0\0\0\0"
"""Last bytes of a stream that was closed."""


class Journal:
    """Rows on their way to disk, written by a thread of its own: no leg must wait for a disk."""

    def __init__(self, path: Path, columns: Sequence[str], metadata: dict[str, Any]) -> None:
        self.path = path
        self.rows = 0
        types = {name: pa.int64() if name == "sequence" else pa.float64() for name in columns}
        self._schema = pa.schema(types, metadata={KEY: to_json(metadata, str(path)).encode()})
        self._head = self._schema.serialize().to_pybytes()
        self._copy = {header_copy.KEY: header_copy.head_as_text(self._head).encode()}
        self._waiting: deque[Sequence[float]] = deque()
        self._failure: OSError | None = None
        self._last_words: dict[bytes, bytes] | None = None
        path.parent.mkdir(parents=True, exist_ok=True)
        # "x" never overwrites: an existing journal may hold the only samples of an earlier run.
        self._file = open(path, "xb", buffering=0)  # noqa: SIM115, it stays open from the first sample to the last
        self._identity = os.fstat(self._file.fileno())
        take(self._file, wait=True)
        # Two copies: a lost piece of a disk may cover the head and the first copy.
        self._write(self._head + 2 * self._batch([], self._copy))
        self._writing, self._ends = threading.Lock(), threading.Event()
        self._writer = threading.Thread(target=self._keep_flushing, name="journal", daemon=True)
        self._writer.start()

    def append(self, row: Sequence[float]) -> None:
        """Add a sample without waiting for the disk.

        Raises
        ------
        OSError
            The disk refused earlier samples, or has not taken them for too long.
        """
        self._waiting.append(row)
        self.rows += 1
        if self._failure:
            raise self._failure
        if len(self._waiting) > MOST_WAITING:
            raise OSError(f"{MOST_WAITING} samples wait for the disk, which does not answer")

    def flush(self) -> None:
        """Write the waiting samples; return when the operating system has them.

        Raises
        ------
        OSError
            The disk is full or fails; the samples go on waiting.
        """
        with self._writing:
            rows = [self._waiting.popleft() for _ in range(len(self._waiting))]
            if not rows:
                return
            try:
                self._write(self._batch(rows))
            except OSError:
                # In their order, before those that have come meanwhile.
                self._waiting.extendleft(reversed(rows))
                raise

    def _keep_flushing(self) -> None:
        """Flush again and again, until the end or a failure."""
        while not self._failure and not self._ends.wait(FLUSH_S):
            try:
                self._refuse_moved_file()
                self.flush()
            except OSError as error:
                self._failure = error

    def _refuse_moved_file(self) -> None:
        """Refuse to go on writing to a file that was removed or moved: samples would be lost."""
        try:
            is_there = os.path.samestat(os.stat(self.path), self._identity)
        except FileNotFoundError:
            is_there = False
        if not is_there:
            raise FileNotFoundError(
                errno.ENOENT, "it was removed or moved while the run went on", str(self.path)
            )

    def end(self, abort: str | None, metadata: Mapping[str, Any] | None = None) -> None:
        """Set the last words of a journal; that of a killed run has none.

        Parameters
        ----------
        abort : str or None
            Why the run was stopped early; None if it was not.
        metadata : mapping, optional
            Metadata of the run, known at its end.
        """
        words = {ABORT: abort or "", METADATA: json.dumps(metadata or {}), ROWS: str(self.rows)}
        self._last_words = {key: word.encode() for key, word in words.items()}

    def close(self) -> None:
        """Write the rest and close the file."""
        self._ends.set()
        self._writer.join()
        with self._file:  # closed even where the disk is full
            self.flush()
            end = END
            if self._last_words is not None:
                # With another copy of the head: damage may reach beyond the first two.
                end = self._batch([], self._last_words | self._copy) + END
            self._write(end)

    def _batch(
        self, rows: Sequence[Sequence[float]], more: Mapping[bytes, bytes] | None = None
    ) -> bytes:
        """Return rows as a batch of an Arrow stream; its metadata are ``more`` and a checksum."""
        columns = zip(*rows, strict=True) if rows else ((),) * len(self._schema)
        arrays = [
            pa.array(column, type=field.type)
            for column, field in zip(columns, self._schema, strict=True)
        ]
        # Of this whole stream only the batch is kept: the file has one head and one end.
        stream = io.BytesIO()
        with pa.ipc.new_stream(stream, self._schema) as writer:
            metadata = {**(more or {}), checksum.KEY: checksum.BLANK}
            writer.write_batch(
                pa.record_batch(arrays, schema=self._schema), custom_metadata=metadata
            )
        return checksum.with_checksum(stream.getvalue()[len(self._head) : -len(END)], self._head)

    def _write(self, parts: bytes) -> None:
        """Write parts of the stream; all of them or, where the disk is full, nothing."""
        begin, rest = self._file.tell(), memoryview(parts)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            # Half a batch would make all later ones unreadable.
            self._file.truncate(begin)
            self._file.seek(begin)
            raise

    def __enter__(self) -> Self:
        """Return the journal; it is closed at the end of the block."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close()
        if kind and not self.rows:
            self.path.unlink()  # it has no sample, and must not block the next run
