"""Exclusive access to the lines of a rig, for one exoid of this computer at a time."""

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
from pipelines.settings.rig.recording_only import RecordingRig


@contextmanager
def exclusive_access(rig: RigSettings | RecordingRig) -> Iterator[None]:
    """Hold the lines of a rig for the duration of the block.

    Raises
    ------
    DeviceError
        Another process holds one of them.
    """
    if rig.embedded:  # its ports are free ones that no other process knows
        yield
        return
    lines = {line.place: line for line in map(rig.line_of, (*rig.drive, *rig.sensor))}
    with ExitStack() as held:
        for name in sorted({name for line in lines.values() for name in _names(line)}):
            held.enter_context(_held(name))
        yield


def _names(line: LineSettings) -> set[str]:
    """Return the unique names of a line: a serial port's real path, or a host's addresses."""
    if isinstance(line, RtuLine):
        return {os.path.realpath(line.place)}
    with suppress(OSError):  # an unknown host cannot be reached either
        addresses = socket.getaddrinfo(line.host, line.port, type=socket.SOCK_STREAM)
        # By address, as one host may have several names.
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
            with suppress(OSError):  # Windows cannot remove an open file
                path.unlink()


def _locked(path: Path, name: str) -> IO[bytes]:
    """Return the locked file of a line."""
    while True:
        try:
            file = os.fdopen(_opened(path), "rb+", buffering=0)
        except OSError as error:
            raise DeviceError(
                f"{path}: cannot be opened ({error.strerror}), so another exoid may use {name};"
                " repair this file, or set TMPDIR to a common folder; nothing was moved"
            ) from error
        if not take(file, wait=False):
            with file:
                pid = file.read(20).decode(errors="replace").strip() or "unknown"
            raise DeviceError(
                f"{name}: another exoid (process {pid}) uses the devices there; wait for its end;"
                " nothing was moved"
            )
        with suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), os.stat(path)):
                return file
        file.close()  # its former holder has removed it meanwhile


def _opened(path: Path) -> int:
    """Open a file that every user may lock; create it where there is none."""
    flags = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0)
    while True:
        # In two steps: in a folder that all users share, Linux refuses to open another user's file
        # with O_CREAT.
        with suppress(FileNotFoundError):
            return os.open(path, flags)
        with suppress(FileExistsError):
            descriptor = os.open(path, flags | os.O_CREAT | os.O_EXCL, 0o666)
            os.chmod(path, 0o666)  # whatever the umask
            return descriptor
