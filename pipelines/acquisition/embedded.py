"""The embedded rig: a virtual rig in a process of its own, for as long as a run lasts."""

import select
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipelines.errors import DeviceError, SettingsError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import RigSettings

START_S = 180.0
"""Longest start; the very first one compiles the plant."""
END_S = 3.0


@contextmanager
def embedded(rig: RigSettings, path: Path, run: RunSettings, sample_rate_hz: float) -> Iterator[RigSettings]:
    """Run the virtual rig of a file; yields the rig's settings with the port that its devices listen on."""
    command = [
        sys.executable, "-m", "exoid_cli.app", "rig", "serve", str(path), "--run", run.run, "--seed", str(run.seed),
        "--sample-rate-hz", str(sample_rate_hz), "--port", "0", "--until-input-ends",
    ]  # fmt: skip
    with tempfile.TemporaryFile() as complaints:
        # A session of its own: Ctrl-C is for whoever moves the leg, the rig must live to be stopped safely.
        # It ends with its input, which the system closes even where this process is killed.
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=complaints, start_new_session=True
        )
        try:
            port = _port(process, path, complaints)
            yield _at(rig, port)
        finally:
            _end(process)


def _port(process: subprocess.Popen, path: Path, complaints) -> int:
    """Wait for the line in which the rig says where it listens."""
    assert process.stdout is not None  # it was asked for
    ready, _, _ = select.select([process.stdout], [], [], START_S)
    line = process.stdout.readline().decode() if ready else ""
    if ":" in line:
        return int(line.rpartition(":")[2])
    _end(process)
    complaints.seek(0)
    said = complaints.read().decode(errors="replace").strip()
    if not said:
        raise DeviceError(
            f"{path}: the embedded rig did not start within {START_S:g} s; run `exoid rig {path}` to see why"
        )
    # What the rig could not use is the user's to mend here as there.
    kind = SettingsError if process.returncode == SettingsError.exit_code else DeviceError
    raise kind(said.splitlines()[-1].removeprefix("exoid: "))


def _at(rig: RigSettings, port: int) -> RigSettings:
    """Return the rig with every device on a port of this machine."""
    here = {"host": "127.0.0.1", "port": port}
    return rig.model_copy(
        update={
            "drive": tuple(drive.model_copy(update=here) for drive in rig.drive),
            "sensor": tuple(sensor.model_copy(update=here) for sensor in rig.sensor),
        }
    )


def _end(process: subprocess.Popen) -> None:
    for stream in (process.stdin, process.stdout):
        if stream:
            stream.close()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
