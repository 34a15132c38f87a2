"""What a killed run left, made a whole recording."""

from dataclasses import dataclass
from pathlib import Path

from pipelines.acquisition.modbus.file_lock import locked
from pipelines.acquisition.recording.journal import JournalFile
from pipelines.acquisition.recording.recording import (
    Account,
    account_of,
    place_for,
    write_recording,
)
from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import JOURNAL
from pipelines.errors import InputError
from pipelines.validation.suggestion import similar_file


@dataclass(frozen=True)
class Recovered:
    """A recording that was made of a journal."""

    path: Path
    account: Account


def journals_in(place: Path) -> list[Path]:
    """Return the journals below a folder, if there are any; a file stands for itself."""
    return sorted(place.rglob(f"*{JOURNAL}")) if place.is_dir() else [place]


def recover(path: Path, output: Path | None = None) -> Recovered:
    """Make a recording of a journal, and remove the journal where every byte of it told something.

    Parameters
    ----------
    path : Path
        The journal.
    output : Path, optional
        The recording; else what `exoid acquire` would have called it, ``<run>.aborted.parquet`` for
        a run that was killed. A file that is there is never overwritten.

    Raises
    ------
    InputError
        Where it is none, is still written to, or holds no sample, and where the output is there
        already.
    """
    if not path.exists():
        raise InputError(
            f"{path}: no such file;"
            f" {similar_file(path) or '`exoid recover` takes the journal that a killed run left'}"
        )
    if not path.is_file():  # a pipe would be waited for
        raise InputError(
            f"{path}: is no file, expected the journal that a killed run left; name another"
        )
    with locked(path) as lock:
        if not lock.free:
            raise InputError(
                f"{path}: a run is recording there now; wait for its end, or stop it with Ctrl-C"
            )
        journal = JournalFile(path)
        account = account_of(journal)
        if not account.samples:
            raise InputError(f"{path}: {_why_no_sample(account)}")
        output = output or place_for(path.with_name(path.name.removesuffix(JOURNAL)), account.abort)
        if output.exists():
            raise InputError(
                f"{output}: is there already and is not overwritten; name another file with -o"
            )
        RECORDING.refuse_place(output)
        write_recording(journal, output, account, recovered=True)
        if not account.damaged:
            lock.remove()
    return Recovered(output, account)


def _why_no_sample(account: Account) -> str:
    if account.damaged:
        return (
            "no sample in it can be read, it is damaged; nothing was changed; keep it, and check"
            " the disk"
        )
    return "holds no sample, the run ended before its recording began; delete it"
