"""Files that exist whole or not at all."""

import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pipelines.contracts.sameness import same_but_for_the_time
from pipelines.errors import ExoidError, InputError

TEMPORARY = ".tmp"
"""What the names of files and folders end in that are not yet what they are to be; they begin with
a dot."""


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; what was written there becomes ``path`` once the
    block ends well.

    The folder is made if need be. On any failure, Ctrl-C included, the temporary file goes and
    ``path`` stays as it was; so it does, with a new time, where nothing but ``created_at`` would be
    another.
    """
    refuse_what_is_no_file(path)
    path = Path(os.path.realpath(path))  # a link keeps pointing at the file it names
    path.parent.mkdir(parents=True, exist_ok=True)
    # Not tempfile: its files are readable by their owner alone, and would stay so under the final
    # name.
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}{TEMPORARY}")
    try:
        yield temporary
        _sync(temporary, os.O_RDWR)  # Windows brings to disk only what could be written to
        _put(temporary, path, is_same=same_but_for_the_time(path, temporary))
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename in (None, str(temporary), temporary):
            error.filename = str(path)  # the name that the user knows; Arrow tells none
        raise
    with suppress(OSError):  # some file systems cannot sync a folder; the file itself is safe
        _sync(path.parent, os.O_RDONLY)


def refuse_what_is_no_file(path: Path) -> None:
    """Refuse to replace a folder, a pipe or a device: a file in its place would take it from all
    who use it."""
    _refuse_the_dash(path)
    if path.exists() and not path.is_file():
        kind = "a folder" if path.is_dir() else "a pipe or a device"
        raise InputError(f"{path}: is {kind}, expected the name of a file to write; name another")


def _refuse_the_dash(path: Path) -> None:
    if path.name == "-":
        raise InputError(
            "-: stands for no standard output here, and would be a file of that name; name another"
        )


@contextmanager
def all_or_none(folder: Path, vouching: str | None = None) -> Iterator[Path]:
    """Yield a temporary folder within ``folder``; the files written there move up once the block
    ends well.

    On any failure, Ctrl-C included, they go and ``folder`` stays as it was. The one whose name is
    ``vouching`` moves last, and never stands beside others than those it was made with.
    """
    with tempfile.TemporaryDirectory(prefix=".", suffix=TEMPORARY, dir=folder) as temporary:
        try:
            yield Path(temporary)
        except ExoidError as error:  # of a file by a name that nobody knows
            raise type(error)(str(error).replace(temporary, str(folder))) from error
        except OSError as error:
            error.filename = error.filename and str(error.filename).replace(temporary, str(folder))
            raise
        made = {
            file: Path(os.path.realpath(folder / file.name))
            for file in sorted(Path(temporary).iterdir())
        }
        for path in made.values():
            refuse_what_is_no_file(path)
        same = {file: same_but_for_the_time(path, file) for file, path in made.items()}
        if vouching and not all(same.values()):
            made[Path(temporary) / vouching].unlink(missing_ok=True)
            same[Path(temporary) / vouching] = False
        for file in sorted(made, key=lambda file: file.name == vouching):
            _put(file, made[file], is_same=same[file])


def _put(made: Path, path: Path, *, is_same: bool) -> None:
    """Put a file in its place, unless it says what the one there says, of which others may know the
    hash."""
    if is_same:
        os.utime(path)  # make goes by times
        made.unlink()
    else:
        os.replace(made, path)


@contextmanager
def folder_to_fill(path: Path) -> Iterator[None]:
    """Open a folder for what is made in the block; where that fails, the folders that were made for
    it go again."""
    made = [folder for folder in (path, *path.parents) if not folder.exists()]
    open_folder(path)
    try:
        yield
    except BaseException:
        for folder in made:
            with suppress(OSError):  # what is not empty stays
                folder.rmdir()
        raise


def leftovers(folder: Path) -> list[Path]:
    """Return what killed runs left of their work within a folder, or what others have at work there
    now."""
    return sorted(folder.glob(f".*{TEMPORARY}"))


def open_folder(path: Path) -> None:
    """Make a folder; where nothing can be written in it, raise the system's refusal before the
    work, not after it."""
    _refuse_the_dash(path)
    path.mkdir(parents=True, exist_ok=True)
    try:
        with tempfile.TemporaryFile(dir=path) as probe:
            probe.write(b"exoid")  # a full disk takes names still, but no bytes
    except OSError as error:
        error.filename = str(path)
        raise


def write_text(path: Path, text: str) -> None:
    """Write a small UTF-8 text file atomically."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _sync(path: Path, how: int) -> None:
    descriptor = os.open(path, how)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
