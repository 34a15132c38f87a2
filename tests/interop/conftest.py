"""Other people's Modbus: what is not installed here is skipped, with the command that would bring
it."""

import asyncio
import queue
import re
import shutil
import subprocess
import threading
from contextlib import contextmanager
from ctypes.util import find_library
from functools import partial
from pathlib import Path

import pytest

from pipelines.rig.server import serve
from pipelines.rig.virtual_rig import build_plant
from pipelines.settings import datasets
from pipelines.settings.rig import load_rig

SERVER = Path(__file__).with_name("leg_server.c")

EXCITATION = """\
unit = "rad"
omega_rad_s = 6.283185307179586
theta0_rad = [0.5, -0.7]
a = [[0.1, -0.05], [0.1, 0.0]]
b = [[0.0, 0.05], [0.05, -0.05]]
"""


def need(path, what, command):
    """Skip where an implementation is missing."""
    if not path:
        pytest.skip(f"{what} is not installed; `{command}` brings it")


@pytest.fixture(scope="session")
def mbpoll():
    """Read holding registers with mbpoll; returns the values as it prints them."""
    need(shutil.which("mbpoll"), "mbpoll", "apt-get install mbpoll")

    def poll(port, unit, address, kind, *values, count=1):
        command = [
            "mbpoll",
            "-m",
            "tcp",
            "-p",
            str(port),
            "-a",
            str(unit),
            "-0",
            "-r",
            str(address),
            "-t",
            kind,
            "-1",
        ]
        amount = [] if values else ["-c", str(count)]
        command += ["-B", *amount, "127.0.0.1", *(["--", *map(str, values)] if values else [])]
        done = subprocess.run(command, capture_output=True, text=True, timeout=20)
        return (
            done.returncode,
            re.findall(r"^\[\d+\]:\s+(\S+)", done.stdout, re.MULTILINE),
            done.stderr,
        )

    return poll


@pytest.fixture(scope="session")
def libmodbus():
    """Return the path of libmodbus itself, for a client."""
    library = find_library("modbus")
    need(library, "libmodbus", "apt-get install libmodbus-dev")
    return library


@pytest.fixture(scope="session")
def leg_on_libmodbus(tmp_path_factory):
    """Compile the leg that libmodbus serves; calling it serves one, as a context that yields the
    port."""
    need(shutil.which("gcc"), "gcc", "apt-get install gcc libc6-dev")
    program = tmp_path_factory.mktemp("libmodbus") / "leg_server"
    command = ["gcc", "-Wall", "-Wextra", "-Werror", "-O1", "-o", program, SERVER]
    built = subprocess.run(
        [*command, "-I/usr/include/modbus", "-lmodbus"], capture_output=True, text=True
    )
    need("modbus.h: No such file" not in built.stderr, "libmodbus", "apt-get install libmodbus-dev")
    assert built.returncode == 0, built.stderr
    return lambda: _serving([program])


@pytest.fixture(scope="session")
def leg_on_pymodbustcp():
    """Return what serves a leg by pyModbusTCP, as a context that yields the port."""
    pytest.importorskip(
        "pyModbusTCP", reason="pyModbusTCP is not installed; `make install` brings it"
    )
    from tests.interop.leg import serving_on_pymodbustcp

    return serving_on_pymodbustcp


@pytest.fixture(scope="session")
def our_rig():
    """Return what serves the plain rig with a human, as a context that yields the port."""
    return _serving_ours


@contextmanager
def _serving_ours():
    path = datasets() / "rigs" / "plain.toml"
    rig, plant = load_rig(path), build_plant(load_rig(path), path, "with_human")
    listening = queue.Queue()

    async def serving():
        until = asyncio.Event()
        stop = partial(asyncio.get_running_loop().call_soon_threadsafe, until.set)
        await serve(
            rig,
            plant,
            0,
            lambda place, line: listening.put((int(place.rpartition(":")[2]), stop)),
            until,
        )

    thread = threading.Thread(target=asyncio.run, args=[serving()])
    thread.start()
    port, stop = listening.get(timeout=180)  # the first start compiles the plant
    try:
        yield port
    finally:
        stop()
        thread.join()


@contextmanager
def _serving(command):
    """Run a server that prints its port and ends with its input."""
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield int(process.stdout.readline())
        finally:
            process.stdin.close()
            process.wait(30)


@pytest.fixture
def experiment(tmp_path):
    """Write rig and excitation for a leg at a port; returns their paths."""

    def write(port):
        rig = (
            (datasets() / "rigs" / "plain.toml")
            .read_text()
            .replace("embedded = true", "embedded = false", 1)
        )
        for key, value in {"ramp_s": 0.8, "settle_s": 0.2}.items():
            rig = re.sub(rf"^{key} = [^#\n]*", f"{key} = {value}", rig, flags=re.MULTILINE)
        (tmp_path / "rig.toml").write_text(
            re.sub(r"^(map = .*)$", rf"\1\nport = {port}", rig, flags=re.MULTILINE)
        )
        (tmp_path / "excitation.toml").write_text(EXCITATION)
        return tmp_path / "rig.toml", tmp_path / "excitation.toml"

    return write
