"""Every sample on disk as it comes: an Arrow stream beside the recording, readable wherever it was cut off."""

import json
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import pandas as pd
import pyarrow as pa

from pipelines.contracts.parquet import KEY, to_json
from pipelines.errors import ContractError, InputError

FLUSH_S = 0.2
"""Longest a sample waits before it is written, s; a crash loses no more."""


def journal_of(output: Path) -> Path:
    """Return where the journal of a recording lies while it is being made."""
    return output.with_name(f"{output.name}.journal")


class Journal:
    """Rows on their way to disk."""

    def __init__(self, path: Path, columns: Sequence[str], metadata: dict[str, Any]) -> None:
        self.path = path
        self.rows = 0
        self._columns = columns
        fields = [pa.field(name, pa.int64() if name == "sequence" else pa.float64()) for name in columns]
        self._schema = pa.schema(fields, metadata={KEY: to_json(metadata, str(path)).encode()})
        self._waiting: list[Sequence[float]] = []
        self._flushed = time.monotonic()
        path.parent.mkdir(parents=True, exist_ok=True)
        # Exclusive: a journal that is there already is all that is left of a run.
        self._file = open(path, "xb")  # noqa: SIM115, it stays open from the first sample to the last
        self._stream = pa.ipc.new_stream(self._file, self._schema)
        self._file.flush()

    def append(self, row: Sequence[float]) -> None:
        """Add a sample."""
        self._waiting.append(row)
        self.rows += 1
        if time.monotonic() - self._flushed >= FLUSH_S:
            self.flush()

    def flush(self) -> None:
        """Hand what waits over to the operating system."""
        if self._waiting:
            arrays = [
                pa.array(column, type=field.type)
                for column, field in zip(zip(*self._waiting, strict=True), self._schema, strict=True)
            ]
            self._stream.write_batch(pa.record_batch(arrays, schema=self._schema))
            self._file.flush()
            self._waiting = []
        self._flushed = time.monotonic()

    def close(self) -> None:
        """Write the rest and close the file."""
        with self._file:  # closed even where the disk is full
            self.flush()
            self._stream.close()

    def __enter__(self) -> Self:
        """Return the journal; it is closed at the end of the block."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close()
        if kind and not self.rows:
            self.path.unlink()  # nothing is lost, and nothing stands in the way of the next run


def read_journal(path: Path) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Return the rows and the metadata in a journal, whole or cut off anywhere."""
    batches = []
    try:
        stream = pa.ipc.open_stream(path.read_bytes())
        metadata = json.loads(stream.schema.metadata[KEY])
    except (pa.ArrowException, KeyError, TypeError, ValueError) as error:
        raise ContractError(f"{path}: is no journal of a run, or not even its head was written; delete it") from error
    with suppress(pa.ArrowException, OSError):  # the last batch was cut off; those before it are whole
        batches.extend(stream)
    return pa.Table.from_batches(batches, schema=stream.schema).to_pandas(), metadata


def refuse_leftover(path: Path) -> None:
    """Refuse to record over what a killed run left."""
    if not path.exists():
        return
    try:
        frame, metadata = read_journal(path)
        seconds = frame["time_s"].iloc[-1] if len(frame) else 0.0
        what = f"{len(frame)} samples ({seconds:.1f} s) of a run {metadata['run']} that was killed"
    except ContractError:
        what = "no sample of a run that was killed"
    raise InputError(
        f"{path}: holds {what}; another run may be recording there now; else move the journal away to keep it, "
        "or delete it"
    )
