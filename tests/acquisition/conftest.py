import asyncio
import re
import socket
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

from pipelines.acquisition.acquire import acquire
from pipelines.contracts import RECORDING
from pipelines.rig import server
from pipelines.rig.device import Device
from pipelines.rig.virtual_rig import VirtualRig, build_plant
from pipelines.settings import datasets
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig

EXCITATION = """\
unit = "rad"
omega_rad_s = 6.283185307179586
theta0_rad = [0.5, -0.7]
a = [[0.1, -0.05], [0.1, 0.0]]
b = [[0.0, 0.05], [0.05, -0.05]]
"""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def excitation(tmp_path):
    """One second long, repeating, as TOML."""
    path = tmp_path / "excitation.toml"
    path.write_text(EXCITATION)
    return path


@pytest.fixture
def rig_file(tmp_path):
    """Write a shipped rig file with changes; short ramps keep the tests short."""

    def write(shipped="plain", port=None, replace=None, drop=(), **changes) -> Path:
        text = (
            (datasets() / "rigs" / f"{shipped}.toml")
            .read_text()
            .replace("embedded = true", "embedded = false", 1)
        )
        if port:
            text = re.sub(r"^(map = .*)$", rf"\1\nport = {port}", text, flags=re.MULTILINE)
        # Hardly a shipped file names these.
        silent = {key: changes.pop(key) for key in ("connect_s", "control_s") if key in changes}
        text = text.replace(
            "[safety]\n",
            "[safety]\n" + "".join(f"{key} = {value}\n" for key, value in silent.items()),
        )
        for key, value in {"ramp_s": 0.8, "settle_s": 0.2, "watchdog_s": 1.0, **changes}.items():
            text, count = re.subn(
                rf"^{key} = [^#\n]*", f"{key} = {value} ", text, flags=re.MULTILINE
            )
            assert count, key
        for old, new in (replace or {}).items():
            assert old in text
            text = text.replace(old, new)
        text = "".join(
            line for line in text.splitlines(keepends=True) if not line.startswith(tuple(drop))
        )
        path = tmp_path / f"rig{len(list(tmp_path.glob('rig*.toml')))}.toml"
        path.write_text(text)
        return path

    return write


class Served:
    """A rig in a thread of this process, and what its devices look like from inside."""

    def __init__(self, path: Path, run: str, seed: int, port: int) -> None:
        self.rig: VirtualRig
        self._rig, self._port = load_rig(path), port
        self._plant = build_plant(self._rig, path, run, seed)
        self._listening = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()))

    async def _serve(self) -> None:
        self._loop, self._until = asyncio.get_running_loop(), asyncio.Event()
        await server.serve(
            self._rig,
            self._plant,
            self._port,
            lambda place, line: self._listening.set(),
            self._until,
        )

    def start(self) -> None:
        self._thread.start()
        assert self._listening.wait(180)  # the first start compiles the plant

    @property
    def enabled(self) -> list[bool]:
        """Whether each drive has been told to follow its set-point."""
        for drive in self.rig.drives:
            drive.receive()
        return [drive.servo.enabled for drive in self.rig.drives]

    def stop_soon(self) -> None:
        """Ask the rig to end, from within."""
        self._until.set()

    def stop(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._until.set)
            self._thread.join()


@pytest.fixture
def serve(monkeypatch):
    """Serve a rig file; ``fault(device, function, written)`` is asked before every access."""

    @contextmanager
    def serving(path, port, run="exo_alone", seed=0, fault=None):
        made = []
        build, answer = VirtualRig.__init__, Device._serve

        def remember(self, *arguments):
            made.append(self)
            build(self, *arguments)

        async def faulty(self, function, first, address, count, registers, written):
            if fault and (code := fault(self, function, written)):
                return code
            return await answer(self, function, first, address, count, registers, written)

        monkeypatch.setattr(VirtualRig, "__init__", remember)
        monkeypatch.setattr(Device, "_serve", faulty)
        served = Served(path, run, seed, port)
        served.start()
        served.rig = made[0]
        try:
            yield served
        finally:
            served.stop()

    return serving


@pytest.fixture
def any_rate(monkeypatch):
    """Begin runs however busy this computer is: no claim of the test depends on its speed."""

    async def accept(machine, cycle_hz):
        pass

    monkeypatch.setattr("pipelines.acquisition.acquire.refuse_unkept_rate", accept)


@pytest.fixture
def record(tmp_path, excitation, rig_file, serve):
    """Record a run on a rig served in this process; returns the recording."""

    def run(
        duration_s=1.0,
        run="exo_alone",
        seed=0,
        fault=None,
        served_as=None,
        believed=None,
        rate_hz=200.0,
        hooks=None,
        **changes,
    ):
        """``believed`` are changes of the rig file that acquisition reads, not of the rig that is
        there.

        ``hooks`` are called by acquisition: ``begin``, ``claim``.
        """
        port, replace = free_port(), changes.pop("replace", None) or {}
        rig = rig_file(port=port, replace=replace, **changes)
        seen = rig_file(port=port, replace=replace | believed, **changes) if believed else rig
        settings = RunSettings(
            name="test", run=run, purpose="train", duration_s=duration_s, seed=seed
        )
        output = tmp_path / "test.parquet"
        with serve(rig, port, run, seed, fault) as served:
            if served_as is not None:
                served_as.append(served)
            acquire(seen, settings, excitation, output, rate_hz, **(hooks or {}))
        return RECORDING.read(output)

    return run
