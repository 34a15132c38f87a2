"""The virtual rig behind Modbus servers, one for each line."""

import asyncio
import logging
import signal
import sys
import threading
from collections import defaultdict
from collections.abc import Callable
from contextlib import AsyncExitStack, nullcontext
from pathlib import Path
from types import FrameType

import numpy as np
from pymodbus.simulator import SimDevice

from pipelines.errors import SettingsError
from pipelines.process.event_loop import exact_event_loop
from pipelines.process.priority import urgent
from pipelines.process.termination import ENDING, handled, known, not_ignored
from pipelines.rig.device import Drive
from pipelines.rig.listening import listening
from pipelines.rig.plant import JOINTS, Plant
from pipelines.rig.ring import fifo_request
from pipelines.rig.virtual_rig import VirtualRig, build_plant
from pipelines.settings.rig import RigSettings, load_rig
from pipelines.settings.rig.line import LineSettings, RtuLine, TcpLine

Announce = Callable[[str, str | None], None]
"""Called with an address and the name of its line; None for devices that are on no line."""


async def serve(
    rig: RigSettings,
    plant: Plant,
    port: int | None,
    announce: Announce,
    until: asyncio.Event,
    bind: str = "127.0.0.1",
    sample_rate_hz: float | None = None,
) -> None:
    """Serve a rig on this computer until an event is set.

    Parameters
    ----------
    rig : RigSettings
    plant : Plant
    port : int or None
        One TCP port for all devices, 0 for a free one per line; None for those of the rig file.
    announce : callable
        Called with the address of each server once it listens, and the name of its line, None for
        devices on no line.
    until : asyncio.Event
    bind : str
        Address on which TCP ports listen.
    sample_rate_hz : float, optional
        Rate of set-points; by default that of the plant's settings.

    Raises
    ------
    SettingsError
        One ``port`` is given for several lines, or for a serial one.
    """
    virtual = VirtualRig(rig, plant, sample_rate_hz)
    on_line: dict[str | int, list[SimDevice]] = defaultdict(list)
    queues: dict[str | int, dict[int, Callable]] = defaultdict(dict)
    functions: dict[str | int, dict[int, set[int]]] = defaultdict(dict)
    for settings, device in zip(
        (*rig.drive, *rig.sensor), (*virtual.drives, *virtual.sensors), strict=True
    ):
        # Devices on no line share a server where they share a port, as units of one gateway.
        own_port = settings.port if port is None else port
        key = own_port if settings.line is None else settings.line
        on_line[key].append(device.as_served())
        functions[key][device.unit] = device.functions
        if isinstance(device, Drive):
            queues[key][device.unit] = device.queue
    if port and len(on_line) > 1:
        raise SettingsError(
            f"--port: found {port} for {len(on_line)} lines, expected one line; leave it out for"
            " the places that the rig file names, or give 0 for free ones"
        )
    first_line = rig.line.get(str(next(iter(on_line))))
    if port and isinstance(first_line, RtuLine):
        raise SettingsError(
            f"--port: found {port}, but the rig is on a serial line, {first_line.serial_port};"
            " leave it out, or give 0 for a pseudo-terminal of any name"
        )
    clock = None if virtual.lockstep else asyncio.ensure_future(virtual.keep_time())
    try:
        async with AsyncExitStack() as servers:
            for key, devices in on_line.items():
                name, line = (
                    (key, rig.line[key])
                    if isinstance(key, str)
                    else (None, TcpLine.model_construct(port=key))
                )
                served = listening(
                    _placed(line, bind, port), devices, [fifo_request(queues[key])], functions[key]
                )
                announce(await servers.enter_async_context(served), name)
            await until.wait()
    finally:
        if clock:
            clock.cancel()


def _placed(line: LineSettings, bind: str, port: int | None) -> LineSettings:
    """Return a line with the address at which it is served."""
    if isinstance(line, RtuLine):
        return line if port is None else line.at("")
    return line.at(f"{bind}:{line.port if port is None else port}")


def serve_file(
    path: Path,
    run: str,
    seed: int,
    port: int | None,
    sample_rate_hz: float | None,
    announce: Announce,
    *,
    until_input_ends: bool,
    bind: str = "127.0.0.1",
) -> None:
    """Serve the rig of a file until a signal comes or, if wanted, standard input is closed.

    The latter ends the rig with the process that started it: the operating system closes the pipe
    even if that process is killed.
    """
    rig = load_rig(path)
    # The first sample compiles the plant, which may take seconds: before a client waits for it.
    build_plant(rig, path, run, seed, sample_rate_hz).run(
        np.zeros((1, len(JOINTS))), np.zeros(len(JOINTS), bool)
    )
    # A second plant: in the first one, a sample of the seed's noise is spent.
    plant = build_plant(rig, path, run, seed, sample_rate_hz)

    async def until_stopped() -> None:
        until, loop = asyncio.Event(), asyncio.get_running_loop()
        if until_input_ends:

            def wait() -> None:
                sys.stdin.buffer.read()
                loop.call_soon_threadsafe(until.set)

            threading.Thread(target=wait, daemon=True).start()

        # Noted, not raised as exceptions, which compiled code could swallow.
        def note(number: int, frame: FrameType | None) -> None:
            came.append(number)
            loop.call_soon_threadsafe(until.set)  # this wakes a loop that waits

        with handled(not_ignored(known(ENDING)), note):
            await serve(rig, plant, port, announce, until, bind, sample_rate_hz)

    came: list[int] = []
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    with (
        nullcontext() if rig.clock == "lockstep" else urgent(),
        asyncio.Runner(loop_factory=exact_event_loop) as runner,
    ):
        runner.run(until_stopped())
    for number in came:
        # Ctrl-C is the normal end; for other signals the process must end by that signal.
        if number != signal.SIGINT:
            signal.raise_signal(number)
