"""Reading of a journal that is complete, cut off or damaged anywhere, batch by batch."""

import json
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa

from pipelines.acquisition.modbus.file_lock import locked
from pipelines.acquisition.recording import checksum
from pipelines.acquisition.recording.header_copy import find_head
from pipelines.acquisition.recording.journal import ABORT, END
from pipelines.contracts.equality import KEY
from pipelines.contracts.run_paths import JOURNAL
from pipelines.errors import ContractError, InputError

MARK = re.compile(rb"\xff{4}(?!\xff)")
"""First bytes of every part of an Arrow stream; its length follows, a multiple of eight."""


@dataclass(frozen=True)
class Batch:
    """Some rows of a journal, and the run's last words where these are its end."""

    rows: pa.RecordBatch
    last_words: dict[bytes, bytes] | None


class JournalFile:
    """A journal of a run that has ended or was killed."""

    def __init__(self, path: Path) -> None:
        """Read the head.

        Raises
        ------
        ContractError
            The file is not a journal, or has no undamaged head.
        InputError
            The disk reports an error.
        """
        self.path = path
        self.damaged = self.rows = 0
        """Bytes without meaning, and samples, of the last reading of all batches."""
        with open(path, "rb") as file:
            try:
                # A copy has a checksum, the head itself none: where they differ, the copy is right.
                self._head = find_head(file) or _part_at(file, 0)
                is_whole = self._head == _between(file, 0, len(self._head))
                self.schema = pa.ipc.open_stream(self._head).schema
                self.metadata: dict[str, Any] = json.loads(self.schema.metadata[KEY])
            except OSError as error:
                if error.errno is not None:  # of the disk, not of Arrow
                    raise _disk_error(path, error) from error
                raise ContractError(f"{path}: {_why_no_journal(path)}") from error
            except (pa.ArrowException, EOFError, KeyError, TypeError, ValueError) as error:
                raise ContractError(f"{path}: {_why_no_journal(path)}") from error
        self._lost = 0 if is_whole else len(self._head)

    def batches(self) -> Iterator[Batch]:
        """Yield all undamaged batches; after damage or a cut, search for the next one.

        Raises
        ------
        InputError
            The disk reports an error.
        """
        self.damaged, self.rows = self._lost, 0
        with open(self.path, "rb") as file:
            unread_from = len(self._head)
            place: int | None = unread_from
            while place is not None:
                batch = self._batch_at(file, place)
                if batch:
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
        """Return the batch at a place of the file, and leave the file at its end; None for none."""
        try:
            part = _part_at(file, place)
            if not checksum.fits(part, self._head):
                return None
            stream = pa.ipc.open_stream(self._head + part)
            rows, words = stream.read_next_batch_with_custom_metadata()
        except OSError as error:
            if error.errno is None:  # of Arrow, not of the disk
                return None
            raise _disk_error(self.path, error) from error
        except (pa.ArrowException, EOFError, ValueError):
            return None
        return Batch(rows, dict(words) if words and ABORT in words else None)


def _disk_error(path: Path, error: OSError) -> InputError:
    return InputError(
        f"{path}: cannot be read ({error.strerror}); nothing was changed; copy it to another disk"
    )


def _why_no_journal(path: Path) -> str:
    # Length of a file that is too short for a sample: a head with columns and metadata is longer.
    no_sample = 512
    # Only a file with a journal's name can be the rest of one.
    if not path.name.endswith(JOURNAL):
        return f"is no journal of a run, nothing was changed; name a *{JOURNAL}"
    size = path.stat().st_size
    if size <= no_sample:
        return (
            "is no journal of a run, or not even its head was written and so no sample; delete it"
        )
    return (
        f"the head of its {size} bytes, which names the columns, is damaged or cut off, and so are"
        " its copies; nothing was changed; keep it, it may hold samples, and check the disk"
    )


class _BoundedFile:
    """A file that never reads beyond its end, even if damaged bytes make Arrow ask for that."""

    closed = False

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._end = file, os.fstat(file.fileno()).st_size

    def read(self, count: int) -> bytes:
        """Return so many bytes, or the rest."""
        return self._file.read(max(0, min(count, self._end - self._file.tell())))


def _part_at(file: BinaryIO, place: int) -> bytes:
    """Return the part of a stream at a place of the file, and leave the file at its end."""
    file.seek(place)
    pa.ipc.read_message(pa.PythonFile(_BoundedFile(file), mode="r"))
    return _between(file, place, file.tell())


def _between(file: BinaryIO, begin: int, end: int) -> bytes:
    file.seek(begin)
    return file.read(end - begin)


def _next_mark(file: BinaryIO, begin: int) -> int | None:
    """Return the next place, from ``begin`` on, where a part may begin; None for none."""
    # Bytes that are searched at once for the next mark.
    scanned = 65536
    while len(chunk := _between(file, begin, begin + scanned)) >= 4:
        match = MARK.search(chunk)
        if match:
            return begin + match.start()
        begin += len(chunk) - 3  # a mark may begin in the last three bytes
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
    """Refuse to record where another run is recording, or where a killed one left its journal.

    Raises
    ------
    InputError
        Names the journal and how to recover or remove it.
    """
    if not path.exists():
        return
    with locked(path) as lock:
        if not lock.free:
            raise InputError(f"{path}: another run is recording there now; choose another output")
    journal = JournalFile(path)
    rows = sum(batch.rows.num_rows for batch in journal.batches())
    raise InputError(
        f"{path}: holds {rows} samples of a run {journal.metadata.get('run')} that was killed;"
        f" `exoid recover {path}` makes a recording of them; or"
        f" {'move it away, it is damaged' if journal.damaged else 'delete it'}"
    )
