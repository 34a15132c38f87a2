"""A file's lock, which the system takes away whatever becomes of the process that holds it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:  # on Windows
    fcntl = None  # type: ignore[assignment]

FAR = 1 << 40
"""Place of the byte that Windows locks, where nothing ever stands: it keeps others from reading
what is locked."""


def take(file: IO[bytes], *, wait: bool) -> bool:
    """Take the lock of an open file; return False where another process holds it, unless told to
    wait for it."""
    if fcntl is None:
        return _take_a_byte(file, wait=wait)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    return True


def _take_a_byte(file: IO[bytes], *, wait: bool) -> bool:
    import msvcrt  # mypy knows its contents on Windows only

    place = file.tell()
    file.seek(FAR)
    try:
        how = msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK  # type: ignore[attr-defined]
        msvcrt.locking(file.fileno(), how, 1)  # type: ignore[attr-defined]
    except OSError:
        return False
    finally:
        file.seek(place)
    return True


@dataclass(frozen=True)
class Lock:
    """The lock of a file, as far as it could be had."""

    path: Path
    free: bool
    """Whether it could; if not, another process holds it."""
    _file: IO[bytes]

    def remove(self) -> None:
        """Remove the file, as the last that is done while it is locked."""
        if fcntl is None:
            self._file.close()  # Windows removes no file that is open
        self.path.unlink()


@contextmanager
def locked(path: Path) -> Iterator[Lock]:
    """Hold a file's lock for as long as the block lasts."""
    with open(path, "rb") as file:
        yield Lock(path, take(file, wait=False), file)
