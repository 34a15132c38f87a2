"""A recording made of the journal that a killed run left."""

from dataclasses import dataclass
from pathlib import Path

from pipelines.acquisition.modbus.file_lock import locked
from pipelines.acquisition.recording.journal_file import JournalFile
from pipelines.acquisition.recording.recording import (
    JournalSummary,
    recording_path,
    summarize,
    write_recording,
)
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import JOURNAL
from pipelines.errors import InputError
from pipelines.validation.suggestion import similar_file


@dataclass(frozen=True)
class Recovery:
    """A recording that was made of a journal."""

    path: Path
    summary: JournalSummary


def journals_in(place: Path) -> list[Path]:
    """Return all journals below a folder, or the file itself."""
    return sorted(place.rglob(f"*{JOURNAL}")) if place.is_dir() else [place]


def recover(path: Path, output: Path | None = None) -> Recovery:
    """Make a recording of a journal, and remove the journal if it is undamaged.

    Parameters
    ----------
    path : Path
        The journal.
    output : Path, optional
        The recording; by default the name that `exoid acquire` gives it, which for a killed run is
        ``<run>.aborted.parquet``. No file is overwritten.

    Raises
    ------
    InputError
        The file is not a journal, is still written to or has no sample, or the output exists.
    """
    if not path.exists():
        raise InputError(
            f"{path}: no such file;"
            f" {similar_file(path) or '`exoid recover` takes the journal that a killed run left'}"
        )
    if not path.is_file():  # reading a pipe could wait for ever
        raise InputError(
            f"{path}: is no file, expected the journal that a killed run left; name another"
        )
    # Until the recording is written: another process must not recover the same journal.
    with locked(path) as lock:
        if not lock.free:
            raise InputError(
                f"{path}: a run is recording there now; wait for its end, or stop it with Ctrl-C"
            )
        journal = JournalFile(path)
        summary = summarize(journal)
        if not summary.samples:
            raise InputError(f"{path}: {_why_no_sample(summary)}")
        output = output or recording_path(
            path.with_name(path.name.removesuffix(JOURNAL)), summary.abort
        )
        if output.exists():
            raise InputError(
                f"{output}: is there already and is not overwritten; name another file with -o"
            )
        RECORDING.refuse_place(output)
        write_recording(journal, output, summary, recovered=True)
        if not summary.damaged:
            lock.remove()
    return Recovery(output, summary)


def _why_no_sample(summary: JournalSummary) -> str:
    if summary.damaged:
        return "no sample in it can be read, it is damaged; keep it, and check the disk"
    return "holds no sample, the run ended before its recording began; delete it"
