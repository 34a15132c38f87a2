"""A lock on a file, which the system releases when the process that holds it ends or is killed."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:  # on Windows
    fcntl = None  # type: ignore[assignment]


def take(file: IO[bytes], *, wait: bool) -> bool:
    """Lock an open file; return False, or ``wait``, where another process holds the lock."""
    if fcntl is None:
        return _take_a_byte(file, wait=wait)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    return True


def _take_a_byte(file: IO[bytes], *, wait: bool) -> bool:
    # Offset of the byte that Windows locks, beyond any content: no one else can read locked bytes.
    far = 1 << 40
    import msvcrt  # its contents are known to mypy only on Windows

    place = file.tell()
    file.seek(far)
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
    """An attempt to lock a file."""

    path: Path
    free: bool
    """Whether it succeeded; if not, another process holds the lock."""
    _file: IO[bytes]

    def remove(self) -> None:
        """Remove the file; nothing may use the lock after this."""
        if fcntl is None:
            self._file.close()  # Windows cannot remove an open file
        self.path.unlink()


@contextmanager
def locked(path: Path) -> Iterator[Lock]:
    """Try to lock a file for the duration of the block."""
    with open(path, "rb") as file:
        yield Lock(path, take(file, wait=False), file)
