"""The embedded rig: a virtual rig in a process of its own, for the duration of a run."""

import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from pipelines.errors import DeviceError, SettingsError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.line import TcpLine

START_S = 180.0
"""Longest start; the first one on a computer compiles the plant."""
# Ctrl-C must not reach the rig, which has to live until its drives are disabled.
_ON_ITS_OWN: dict[str, Any] = (
    {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    if hasattr(subprocess, "CREATE_NEW_PROCESS_GROUP")
    else {"start_new_session": True}
)


@contextmanager
def embedded(
    rig: RigSettings, path: Path, run: RunSettings, sample_rate_hz: float
) -> Iterator[RigSettings]:
    """Run the virtual rig of a file; yield the rig's settings with the addresses of its devices."""
    command = [sys.executable, "-m", "exoid_cli", "rig", "serve", str(path), "--run", run.run]
    command += ["--seed", str(run.seed), "--sample-rate-hz", str(sample_rate_hz)]
    command += ["--port", "0", "--until-input-ends"]
    # A file, as a pipe that nobody reads would fill up and block the rig.
    with tempfile.TemporaryFile() as errors:
        # The rig ends with its input, which the system closes even if this process is killed.
        process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            bufsize=0,
            **_ON_ITS_OWN,
        )
        # Reading the rig's first lines has no time-out of its own.
        late = threading.Timer(START_S, process.kill)
        late.start()
        try:
            lines = len({device.line for device in (*rig.drive, *rig.sensor)})
            places = dict(_place(process, path, errors) for _ in range(lines))
            late.cancel()
            yield _at(rig, places)
        finally:
            late.cancel()
            _end(process)


def _end(process: subprocess.Popen) -> None:
    """End a process by closing its input; kill it if that takes too long."""
    # Longest end before the process is killed.
    end_s = 3.0
    assert process.stdin and process.stdout  # pipes
    process.stdin.close()
    try:
        process.wait(end_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    process.stdout.close()


def _place(process: subprocess.Popen, path: Path, errors: IO[bytes]) -> tuple[str | None, str]:
    """Wait for a line's address; return its name, None for devices on no line, and address."""
    assert process.stdout  # a pipe
    line = process.stdout.readline().decode().strip()
    if line:
        name, _, place = line.rpartition(" ")
        return name or None, place
    _end(process)
    errors.seek(0)
    words = errors.read().decode(errors="replace").strip()
    if not words:
        raise DeviceError(
            f"{path}: the embedded rig did not start within {START_S:g} s; run `exoid rig {path}`"
        )
    # A settings error of the rig's process is one of this command too.
    kind = SettingsError if process.returncode == SettingsError.exit_code else DeviceError
    raise kind(words.splitlines()[-1].removeprefix("exoid: "))


def _at(rig: RigSettings, places: dict[str | None, str]) -> RigSettings:
    """Return the rig with the address of every device on this computer."""
    update: dict[str, Any] = {
        "line": {name: line.at(places[name]) for name, line in rig.line.items()}
    }
    if None in places:
        on_no_line = TcpLine().at(places[None]).model_dump(include={"host", "port"})
        for kind in ("drive", "sensor"):
            devices = getattr(rig, kind)
            update[kind] = tuple(d if d.line else d.model_copy(update=on_no_line) for d in devices)
    return rig.model_copy(update=update)
