"""The embedded rig: a virtual rig in a process of its own, for as long as a run lasts."""

import select
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pipelines.errors import DeviceError, SettingsError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.line import TcpLine
from pipelines.settings.rig import RigSettings

START_S = 180.0
"""Longest start; the very first one compiles the plant."""
END_S = 3.0


@contextmanager
def embedded(rig: RigSettings, path: Path, run: RunSettings, sample_rate_hz: float) -> Iterator[RigSettings]:
    """Run the virtual rig of a file; yields the rig's settings with the places where its devices are."""
    command = [
        sys.executable, "-m", "exoid_cli.app", "rig", "serve", str(path), "--run", run.run, "--seed", str(run.seed),
        "--sample-rate-hz", str(sample_rate_hz), "--port", "0", "--until-input-ends",
    ]  # fmt: skip
    with tempfile.TemporaryFile() as complaints:
        # A session of its own: Ctrl-C is for whoever moves the leg, the rig must live to be stopped safely.
        # It ends with its input, which the system closes even where this process is killed.
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=complaints, start_new_session=True, bufsize=0
        )
        try:
            lines = len({device.line for device in (*rig.drive, *rig.sensor)})
            yield _at(rig, dict(_place(process, path, complaints) for _ in range(lines)))
        finally:
            _end(process)


def _place(process: subprocess.Popen, path: Path, complaints) -> tuple[str | None, str]:
    """Wait until the rig says where a line is; return its name, None for that of devices on none, and the place."""
    assert process.stdout is not None  # it was asked for
    ready, _, _ = select.select([process.stdout], [], [], START_S)
    if line := process.stdout.readline().decode().strip() if ready else "":
        name, _, place = line.rpartition(" ")
        return name or None, place
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


def _at(rig: RigSettings, places: dict[str | None, str]) -> RigSettings:
    """Return the rig with every device where it is found on this machine."""
    update: dict[str, Any] = {"line": {name: line.at(places[name]) for name, line in rig.line.items()}}
    if None in places:
        alone = TcpLine().at(places[None]).model_dump(include={"host", "port"})
        for kind in ("drive", "sensor"):
            devices = getattr(rig, kind)
            update[kind] = tuple(d if d.line else d.model_copy(update=alone) for d in devices)
    return rig.model_copy(update=update)


def _end(process: subprocess.Popen) -> None:
    for stream in (process.stdin, process.stdout):
        if stream:
            stream.close()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
