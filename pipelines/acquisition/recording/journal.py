"""Every sample on disk as it comes: an Arrow stream beside the recording, readable wherever it was
cut off or damaged.

Whoever writes a journal holds a lock on it, which the system takes away whatever becomes of the
process: so a run that goes on can be told from one that was killed.
"""

import errno
import io
import json
import os
import re
import threading
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Self

import pyarrow as pa

from pipelines.acquisition.modbus.file_lock import locked, take
from pipelines.acquisition.recording import checksum
from pipelines.acquisition.recording.header_copy import COPY, copy_of, ends_of, head_in
from pipelines.contracts.equality import KEY, MAGIC
from pipelines.contracts.parquet import to_json
from pipelines.contracts.run_paths import JOURNAL
from pipelines.errors import ContractError, InputError

FLUSH_S = 0.2
"""Longest a sample waits before it is written, s; a crash loses no more."""
MOST_WAITING = 20_000
"""Samples that wait for a disk that takes none; then the run stops. 20 s at 1 kHz."""
ABORT = b"abort"
"""Key under which a journal's last words say why the run was stopped early; empty where it was
not."""
FOUND = b"found"
"""Key under which they hold what the run found out for its metadata."""
ROWS = b"rows"
"""Key under which they tell how many samples there must be."""
MARK = re.compile(rb"\xff{4}(?!\xff)")
"""With these bytes every part of an Arrow stream begins; a length comes next, a multiple of eight,
and no fifth."""
END = b"\xff\xff\xff\xff\0\0\0\0"
"""With this a stream ends that was closed."""
SCANNED = 65536
"""Bytes that are looked through at once for the next mark."""
NO_SAMPLE = 512
"""So short a file holds no sample: the head of a run alone, with its columns and metadata, is
longer."""


def field_of(name: str) -> pa.Field:
    """Return how a column of a journal is written."""
    return pa.field(name, pa.int64() if name == "sequence" else pa.float64())


class Journal:
    """Rows on their way to disk, which a thread of its own brings there: a disk that hangs must not
    hold up a leg."""

    def __init__(self, path: Path, columns: Sequence[str], metadata: dict[str, Any]) -> None:
        self.path = path
        self.rows = 0
        self._schema = pa.schema(
            map(field_of, columns), metadata={KEY: to_json(metadata, str(path)).encode()}
        )
        self._head = self._schema.serialize().to_pybytes()
        self._copy = {COPY: copy_of(self._head).encode()}
        self._waiting: deque[Sequence[float]] = deque()
        self._failure: OSError | None = None
        self._last_words: dict[bytes, bytes] | None = None
        path.parent.mkdir(parents=True, exist_ok=True)
        # Exclusive: a journal that is there already is all that is left of a run.
        self._file = open(path, "xb", buffering=0)  # noqa: SIM115, it stays open from the first sample to the last
        self._identity = os.fstat(self._file.fileno())
        take(self._file, wait=True)
        # Two copies: one piece of a disk that is lost may lie across the head and the first.
        self._hand_over(self._head + 2 * self._batch([], self._copy))
        self._writing, self._ends = threading.Lock(), threading.Event()
        self._writer = threading.Thread(target=self._write_on, name="journal", daemon=True)
        self._writer.start()

    def append(self, row: Sequence[float]) -> None:
        """Add a sample; never waits for the disk.

        Raises
        ------
        OSError
            The disk took what came before not, or not for too long.
        """
        self._waiting.append(row)
        self.rows += 1
        if self._failure:
            raise self._failure
        if len(self._waiting) > MOST_WAITING:
            raise OSError(f"{MOST_WAITING} samples wait for the disk, which does not answer")

    def flush(self) -> None:
        """Hand what waits over to the operating system; returns when that has it."""
        with self._writing:
            rows = [self._waiting.popleft() for _ in range(len(self._waiting))]
            if not rows:
                return
            try:
                self._hand_over(self._batch(rows))
            except OSError:
                self._waiting.extendleft(reversed(rows))
                raise

    def _write_on(self) -> None:
        """Flush time after time, until the end or until that fails."""
        while not self._failure and not self._ends.wait(FLUSH_S):
            try:
                self._refuse_elsewhere()
                self.flush()
            except OSError as error:
                self._failure = error

    def _refuse_elsewhere(self) -> None:
        """Refuse to write on to a file that was removed or moved: an open one takes all, and nobody
        finds it again."""
        try:
            is_there = os.path.samestat(os.stat(self.path), self._identity)
        except FileNotFoundError:
            is_there = False
        if not is_there:
            raise FileNotFoundError(
                errno.ENOENT, "it was removed or moved while the run went on", str(self.path)
            )

    def end(self, abort: str | None, metadata: Mapping[str, Any] | None = None) -> None:
        """Say how the run ended: why it was stopped early, None if it was not. Only a killed run
        never says.

        ``found`` is what else its metadata shall tell that was not known before the run.
        """
        words = {ABORT: abort or "", FOUND: json.dumps(metadata or {}), ROWS: str(self.rows)}
        self._last_words = {key: word.encode() for key, word in words.items()}

    def close(self) -> None:
        """Write the rest and close the file."""
        self._ends.set()
        self._writer.join()
        with self._file:  # closed even where the disk is full
            self.flush()
            # The copy once more: what damages the beginning of a file may reach further than its
            # head.
            words = (
                b"" if self._last_words is None else self._batch([], self._last_words | self._copy)
            )
            self._hand_over(words + END)

    def _batch(
        self, rows: Sequence[Sequence[float]], more: Mapping[bytes, bytes] | None = None
    ) -> bytes:
        """Return rows as a part of an Arrow stream, with ``more`` and a checksum as the metadata of
        its own."""
        columns = zip(*rows, strict=True) if rows else ((),) * len(self._schema)
        arrays = [
            pa.array(column, type=field.type)
            for column, field in zip(columns, self._schema, strict=True)
        ]
        stream = io.BytesIO()
        with pa.ipc.new_stream(stream, self._schema) as writer:
            metadata = {**(more or {}), checksum.KEY: checksum.BLANK}
            writer.write_batch(
                pa.record_batch(arrays, schema=self._schema), custom_metadata=metadata
            )
        return checksum.with_checksum(stream.getvalue()[len(self._head) : -len(END)], self._head)

    def _hand_over(self, parts: bytes) -> None:
        """Write parts of the stream; all of them or, where the disk is full, nothing."""
        whole, rest = self._file.tell(), memoryview(parts)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
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
    """A journal as it is found: whole, cut off or damaged anywhere; it is read batch by batch."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damaged = self.rows = 0
        """Of what was read last: bytes that told nothing, and samples."""
        with open(path, "rb") as file:
            try:
                copy = head_in(file)
                self.checked = any(map(checksum.has_any, ends_of(file)))
                """Whether its batches have checksums: those of an older exoid have none, and are
                believed."""
                # The copy has a checksum, the head itself none: where they differ, that one is
                # right.
                self._head = copy or _part_at(file, 0)
                self._lost = (
                    0 if self._head == _between(file, 0, len(self._head)) else len(self._head)
                )
                self.schema = pa.ipc.open_stream(self._head).schema
                metadata = json.loads(self.schema.metadata[KEY])
            except OSError as error:
                _raise_if_the_disk_s(path, error)
                raise ContractError(f"{path}: {_why_no_journal(path)}") from error
            except (pa.ArrowException, EOFError, KeyError, TypeError, ValueError) as error:
                raise ContractError(f"{path}: {_why_no_journal(path)}") from error
        if not isinstance(metadata, dict):
            raise ContractError(
                f"{path}: its metadata are {_short(metadata)}, expected a table of keys and values;"
                " exoid wrote no such journal, nothing was changed"
            )
        self.metadata: dict[str, Any] = metadata

    def batches(self) -> Iterator[Batch]:
        """Yield batch after batch; one that was cut off or is damaged is left out, and what comes
        after it looked for.

        Raises
        ------
        InputError
            The disk does not give back what is on it.
        """
        self.damaged, self.rows = self._lost, 0
        with open(self.path, "rb") as file:
            unread_from = len(self._head)
            place: int | None = unread_from
            while place is not None:
                if batch := self._batch_at(file, place):
                    self.damaged += place - unread_from
                    self.rows += batch.rows.num_rows
                    place = unread_from = file.tell()
                    yield batch
                else:
                    place = _next_mark(file, place + 1)
            rest = file.seek(0, os.SEEK_END) - unread_from
            if rest > 0 and _between(file, unread_from, unread_from + rest) != END:
                self.damaged += rest

    def _batch_at(self, file: BinaryIO, place: int) -> Batch | None:
        """Return the batch that begins at a place of the file, and leave the file at its end; None
        where none does."""
        try:
            part = _part_at(file, place)
            if self.checked and not checksum.fits(part, self._head):
                return None
            rows, words = pa.ipc.open_stream(
                self._head + part
            ).read_next_batch_with_custom_metadata()
            rows.validate()
        except OSError as error:
            _raise_if_the_disk_s(self.path, error)
            return None
        except (pa.ArrowException, EOFError, StopIteration, ValueError):
            return None
        return Batch(rows, dict(words) if words and ABORT in words else None)


def _raise_if_the_disk_s(path: Path, error: OSError) -> None:
    """Raise what the disk said; not what Arrow makes of bytes that are missing or wrong."""
    if error.errno is not None:
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); nothing was changed; copy it to another"
            " disk and recover it there"
        ) from error


def _why_no_journal(path: Path) -> str:
    with open(path, "rb") as file:
        if file.read(len(MAGIC)) == MAGIC:
            return (
                "is no journal of a run but a Parquet file, of which nothing is to be recovered;"
                " see `exoid show`"
            )
    # Only what bears a journal's name can be what is left of one.
    if not path.name.endswith(JOURNAL):
        return (
            f"is no journal of a run, nothing was changed; name the *{JOURNAL} that a killed run"
            " left"
        )
    size = path.stat().st_size
    if size <= NO_SAMPLE:
        return (
            "is no journal of a run, or not even its head was written and so no sample; delete it"
        )
    return (
        f"the head of its {size} bytes, which names the columns, is damaged or cut off, and no"
        " whole copy of it is there; nothing was changed; keep it, samples may be in it; check the"
        " disk, and move it away to record here"
    )


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


class _Within:
    """A file of which no more is read than there is: Arrow asks for as many bytes as damaged bytes
    tell."""

    closed = False

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._end = file, os.fstat(file.fileno()).st_size

    def read(self, count: int) -> bytes:
        """Return so many bytes, or as many as are left."""
        return self._file.read(max(0, min(count, self._end - self._file.tell())))


def _part_at(file: BinaryIO, place: int) -> bytes:
    """Return the part of a stream that begins at a place of the file, and leave the file at its
    end."""
    file.seek(place)
    pa.ipc.read_message(pa.PythonFile(_Within(file), mode="r"))
    return _between(file, place, file.tell())


def _between(file: BinaryIO, begin: int, end: int) -> bytes:
    file.seek(begin)
    return file.read(end - begin)


def _next_mark(file: BinaryIO, begin: int) -> int | None:
    """Return where the next part of a stream may begin, from a place on; None where none does."""
    while len(chunk := _between(file, begin, begin + SCANNED)) >= 4:
        if match := MARK.search(chunk):
            return begin + match.start()
        begin += len(chunk) - 3  # a mark may begin in the last three
    return None


def in_pieces(batches: Iterable[pa.RecordBatch], rows: int) -> Iterator[pa.Table]:
    """Yield batches joined to tables of about so many rows."""
    waiting, count = [], 0
    for batch in batches:
        waiting.append(batch)
        count += batch.num_rows
        if count >= rows:
            yield pa.Table.from_batches(waiting)
            waiting, count = [], 0
    if waiting:
        yield pa.Table.from_batches(waiting)


def refuse_leftover(path: Path) -> None:
    """Refuse to record over what another run writes or has left."""
    if not path.exists():
        return
    with locked(path) as lock:
        if not lock.free:
            raise InputError(
                f"{path}: another run is recording there now; choose another output or wait for"
                " its end"
            )
    journal = JournalFile(path)
    rows = sum(batch.rows.num_rows for batch in journal.batches())
    raise InputError(
        f"{path}: holds {rows} samples of a run {journal.metadata.get('run')} that was killed;"
        f" `exoid recover {path}` makes a recording of them; or"
        f" {'move it away, it is damaged' if journal.damaged else 'delete it'}"
    )
