"""The lines to a rig, each held by one exoid of this computer at a time while it may move or
release a leg."""

import os
import socket
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from typing import IO

from pipelines.acquisition.modbus.file_lock import take
from pipelines.errors import DeviceError
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.line import LineSettings, RtuLine


@contextmanager
def alone(rig: RigSettings) -> Iterator[None]:
    """Hold the lines of a rig for as long as the block lasts.

    Raises
    ------
    DeviceError
        Where another process holds one of them.
    """
    if rig.embedded:  # nobody else knows where it is
        yield
        return
    lines = {line.place: line for line in map(rig.line_of, (*rig.drive, *rig.sensor))}
    with ExitStack() as held:
        for name in sorted({name for line in lines.values() for name in _names(line)}):
            held.enter_context(_held(name))
        yield


def _names(line: LineSettings) -> set[str]:
    """Return what a line is called however a rig file writes it: a port's own path, a host's
    addresses."""
    if isinstance(line, RtuLine):
        return {os.path.realpath(line.place)}
    with suppress(OSError):  # a host that nobody knows will not be reached either
        addresses = socket.getaddrinfo(line.host, line.port, type=socket.SOCK_STREAM)
        return {f"{address[0]}:{line.port}" for *_, address in addresses}
    return {line.place}


@contextmanager
def _held(name: str) -> Iterator[None]:
    path = Path(tempfile.gettempdir()) / f"exoid-line-{sha256(name.encode()).hexdigest()[:16]}.lock"
    with _locked(path, name) as file:
        file.truncate(0)
        file.write(str(os.getpid()).encode())
        file.flush()
        try:
            yield
        finally:
            with suppress(OSError):  # Windows removes no file that is open
                path.unlink()


def _locked(path: Path, name: str) -> IO[bytes]:
    """Return the locked file of a line."""
    while True:
        try:
            file = os.fdopen(_opened(path), "rb+", buffering=0)
        except OSError as error:
            raise DeviceError(
                f"{path}: cannot be opened ({error.strerror}), and so nobody knows whether another"
                f" exoid uses {name}; see to this file, or set TMPDIR to a folder that every user"
                " of the rig may write in; nothing was moved"
            ) from error
        if not take(file, wait=False):
            with file:
                pid = file.read(20).decode(errors="replace").strip() or "unknown"
            raise DeviceError(
                f"{name}: another exoid (process {pid}) uses the devices there; wait for it to end,"
                " or end it; nothing was moved"
            )
        with suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), os.stat(path)):
                return file
        file.close()  # whoever held it has removed it meanwhile


def _opened(path: Path) -> int:
    """Return a descriptor of a file that every user may lock, made where there is none."""
    flags = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0)
    while True:
        # Not made and opened at once: in a folder of everybody's, Linux refuses that with another
        # user's file.
        with suppress(FileNotFoundError):
            return os.open(path, flags)
        with suppress(FileExistsError):
            descriptor = os.open(path, flags | os.O_CREAT | os.O_EXCL, 0o666)
            os.chmod(path, 0o666)  # whatever the umask
            return descriptor
