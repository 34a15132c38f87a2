"""Write files so that each exists whole or not at all."""

import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pipelines.contracts.equality import equal_except_time
from pipelines.errors import ExoidError, InputError

TEMPORARY = ".tmp"
"""Ending of temporary files and folders, whose names begin with a dot."""


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path, which replaces ``path`` once the block ends well.

    The folder is created if need be. On any failure, Ctrl-C included, the temporary file is removed
    and ``path`` stays. It also stays, with a new time, if only ``created_at`` differs.

    Parameters
    ----------
    path : Path
        The file to write.

    Yields
    ------
    Path
        A new file in the same folder.

    Raises
    ------
    InputError
        ``path`` is a folder, a pipe or a device.
    """
    refuse_special(path)
    path = Path(os.path.realpath(path))  # a link keeps pointing at the file it names
    path.parent.mkdir(parents=True, exist_ok=True)
    # Not tempfile, whose files are readable by their owner alone, and stay so when renamed.
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}{TEMPORARY}")
    try:
        yield temporary
        # Synced before it is renamed, or a power cut could leave an empty file under the final
        # name.
        _sync(temporary, os.O_RDWR)  # Windows syncs only files that are open for writing
        _replace(path, temporary, is_equal=equal_except_time(path, temporary))
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename in (None, str(temporary), temporary):
            error.filename = str(path)  # the name that the user knows; Arrow gives none
        raise
    with suppress(OSError):  # some file systems cannot sync a folder; the file itself is safe
        _sync(path.parent, os.O_RDONLY)


def refuse_special(path: Path) -> None:
    """Refuse to replace a folder, a pipe or a device by a file.

    Parameters
    ----------
    path : Path
        A file to write.

    Raises
    ------
    InputError
        Names the path and its kind.
    """
    _refuse_dash(path)
    if path.exists() and not path.is_file():
        kind = "a folder" if path.is_dir() else "a pipe or a device"
        raise InputError(f"{path}: is {kind}, expected the name of a file to write; name another")


def _refuse_dash(path: Path) -> None:
    if path.name == "-":
        raise InputError("-: standard output is not supported; name a file")


@contextmanager
def all_or_none(folder: Path, last: str | None = None) -> Iterator[Path]:
    """Yield a temporary folder whose files move to ``folder`` once the block ends well.

    On any failure, Ctrl-C included, they are removed and ``folder`` stays as it was.

    Parameters
    ----------
    folder : Path
        An existing folder.
    last : str, optional
        Name of the file that moves last, so that it is only ever seen with the files of the same
        block.

    Yields
    ------
    Path
        The temporary folder.

    Raises
    ------
    InputError
        A target is a folder, a pipe or a device.
    """
    with tempfile.TemporaryDirectory(prefix=".", suffix=TEMPORARY, dir=folder) as temporary:
        try:
            yield Path(temporary)
        except ExoidError as error:  # name the folder that the user knows
            raise type(error)(str(error).replace(temporary, str(folder))) from error
        except OSError as error:
            error.filename = error.filename and str(error.filename).replace(temporary, str(folder))
            raise
        files = sorted(Path(temporary).iterdir())
        targets = {file: Path(os.path.realpath(folder / file.name)) for file in files}
        for path in targets.values():
            refuse_special(path)
        equal = {file: equal_except_time(path, file) for file, path in targets.items()}
        if last and not all(equal.values()):
            # If the process is killed from here on, no old `last` stands with new files of the
            # others.
            targets[Path(temporary) / last].unlink(missing_ok=True)
            equal[Path(temporary) / last] = False
        for file in sorted(targets, key=lambda file: file.name == last):
            _replace(targets[file], file, is_equal=equal[file])


def _replace(path: Path, new: Path, *, is_equal: bool) -> None:
    """Replace a file, or only set its time if it is equal: others may know its hash."""
    if is_equal:
        os.utime(path)  # make compares times
        new.unlink()
    else:
        os.replace(new, path)


@contextmanager
def folder_to_fill(path: Path) -> Iterator[None]:
    """Open a folder for the block; remove the folders created for it if the block fails."""
    # The innermost first, as only an empty folder can be removed.
    created = [folder for folder in (path, *path.parents) if not folder.exists()]
    open_folder(path)
    try:
        yield
    except BaseException:
        for folder in created:
            with suppress(OSError):  # a folder that is not empty stays
                folder.rmdir()
        raise


def leftovers(folder: Path) -> list[Path]:
    """Return the temporary files in a folder, of killed runs or of runs that go on."""
    return sorted(folder.glob(f".*{TEMPORARY}"))


def open_folder(path: Path) -> None:
    """Create a folder and check that it can be written to, before the work that fills it.

    Parameters
    ----------
    path : Path
        The folder.

    Raises
    ------
    OSError
        Names the folder if it cannot be written to.
    """
    _refuse_dash(path)
    path.mkdir(parents=True, exist_ok=True)
    try:
        with tempfile.TemporaryFile(dir=path) as probe:
            probe.write(b"exoid")  # a full disk still takes names, but no bytes
    except OSError as error:
        error.filename = str(path)
        raise


def write_text(path: Path, text: str) -> None:
    """Write a small UTF-8 text file atomically."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _sync(path: Path, mode: int) -> None:
    descriptor = os.open(path, mode)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
