"""Replies of a hostile device against exoid's client, over real sockets."""

from __future__ import annotations

import asyncio
import logging
import re
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.machine.force_sensor import Sensor
from pipelines.acquisition.machine.machine import Machine
from pipelines.errors import DeviceError
from pipelines.settings import datasets
from pipelines.settings.rig import RigSettings, load_rig
from tests.campaigns.fuzz.frames import HANG_UP, Frame, Script, mutated, parsed, words
from tests.campaigns.fuzz.outcome import HANG_S, Outcome, peak_mib

SIDE_BY_SIDE = 24
"""Clients: what one waits out, the others use."""
TIMEOUT_S = 0.05
PATIENCE_S = 60.0
RIGHT_SHARE = 0.7
"""Of the replies to an operation that asks many times, else none would get beyond its first."""


class Peer:
    """A device that answers as it is set to; one port, any number of connections."""

    def __init__(self, rig: RigSettings) -> None:
        self._rig = rig
        self.answer: Callable[[Frame], Script] = self.honest
        self.open = 0
        self.sent = bytearray()
        """The last that was sent, on all connections."""
        self.asked: Frame
        """The last request of an operation."""
        self.transcript: list[str] = []
        self.answered = 0

    async def listen(self) -> int:
        """Listen on a free port; returns it."""
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        return self._server.sockets[0].getsockname()[1]

    async def end(self) -> None:
        """Listen no more."""
        self._server.close()

    def honest(self, request: Frame) -> Script:
        """Answer as the right device, all of whose values are 0."""
        return [bytes(replace(request, length=None, body=self._body(request, None)))]

    def hostile(self, rng: Random, right_share: float) -> Callable[[Frame], Script]:
        """Return a function that answers as a generator decides."""

        def answer(request: Frame) -> Script:
            self.answered += 1
            frame = replace(request, length=None, body=self._body(request, rng))
            name, script = (
                ("right", [bytes(frame)]) if rng.random() < right_share else mutated(rng, frame)
            )
            sent = [
                "hang up" if s is HANG_UP else s if isinstance(s, float) else s[:300].hex()
                for s in script[:8]
            ]
            self.transcript.append(f"{bytes(request).hex()} -> {name}: {sent}")
            self.asked = request
            return script

        return answer

    def _body(self, request: Frame, rng: Random | None) -> bytes:
        function, address = request.body[0], int.from_bytes(request.body[1:3], "big")
        if function == 16:
            return request.body[:5]
        count = int.from_bytes(request.body[3:5], "big")
        if rng is None:
            held = {entry.address: entry.value for entry in self._map(request.unit).identity}
            data = b"".join(held.get(address + i, 0).to_bytes(2, "big") for i in range(count))
        else:
            data = words(rng, count)
        return bytes([function, 2 * count]) + data

    def _map(self, unit: int):
        (device,) = [
            device for device in (*self._rig.drive, *self._rig.sensor) if device.unit == unit
        ]
        maps = self._rig.map.drive if device in self._rig.drive else self._rig.map.sensor
        return maps[device.map]

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.open += 1
        sending = asyncio.ensure_future(self._send(writer, []))
        with suppress(OSError, asyncio.IncompleteReadError):
            while True:
                request = await (
                    self._rtu_request(reader) if self._rig.line else self._tcp_request(reader)
                )
                sending.cancel()  # a client that asks again does not listen any more
                sending = asyncio.ensure_future(self._send(writer, self.answer(request)))
        sending.cancel()
        self.open -= 1
        writer.close()

    async def _tcp_request(self, reader: asyncio.StreamReader) -> Frame:
        head = await reader.readexactly(7)
        return parsed(head + await reader.readexactly(int.from_bytes(head[4:6], "big") - 1))

    async def _rtu_request(self, reader: asyncio.StreamReader) -> Frame:
        head = await reader.readexactly(2)
        # Where bytes are counted, the count ends it.
        head += await reader.readexactly({3: 4, 16: 5, 23: 9}[head[1]])
        rest = await reader.readexactly(2 if head[1] == 3 else head[-1] + 2)
        return Frame(0, head[0], head[1:] + rest[:-2], rtu=True)

    async def _send(self, writer: asyncio.StreamWriter, script: Script) -> None:
        with suppress(OSError):
            for step in script:
                if step is HANG_UP:
                    writer.transport.abort()
                elif isinstance(step, float):
                    await asyncio.sleep(step)
                else:
                    self.sent = (self.sent + step)[-(1 << 16) :]
                    writer.write(step)
                    await writer.drain()


class Client:
    """A machine, its hostile peer, and the operations that are tried."""

    def __init__(self, rig: RigSettings) -> None:
        self.peer, self._rig = Peer(rig), rig

    async def open(self) -> None:
        """Connect, all devices being honest."""
        self._port = await self.peer.listen()
        await self._connect()

    async def _connect(self) -> None:
        """Connect a new machine, of which nothing is left of the last operation."""
        self.peer.answer = self.peer.honest
        until = time.monotonic() + PATIENCE_S
        # A time-out this short is missed now and then, most of all during another client's flood.
        while True:
            try:
                await self._connect_once()
                return
            except DeviceError as error:
                await self._hang_up()
                if time.monotonic() > until:
                    raise TimeoutError(
                        f"an honest peer was not reached within {PATIENCE_S:g} s"
                    ) from error

    async def _connect_once(self) -> None:
        here = {"host": "127.0.0.1", "port": self._port}
        self.machine = Machine(
            self._rig.model_copy(
                update={
                    "drive": tuple(d.model_copy(update=here) for d in self._rig.drive),
                    "sensor": tuple(s.model_copy(update=here) for s in self._rig.sensor),
                    "line": {
                        name: line.at(f"127.0.0.1:{self._port}")
                        for name, line in self._rig.line.items()
                    },
                }
            ),
            with_sensors=True,
        )
        self._parts: list[Drive | Sensor] = [*self.machine.drives, *self.machine.sensors]
        await self.machine.connect()
        self._connections = self.peer.open

    async def renew(self) -> None:
        """Connect again where a connection has ended."""
        await asyncio.sleep(0)
        if self.peer.open < self._connections:
            await self._hang_up()
            await self._connect()

    async def end(self) -> None:
        """Close everything, the peer too."""
        await self._hang_up()
        await self.peer.end()

    async def _hang_up(self) -> None:
        self.machine.close()
        while self.peer.open:
            await asyncio.sleep(0.001)

    async def operate(self, rng: Random) -> str:
        """Try one operation on hostile replies; return what came of it, raise what must not come of
        it."""
        self.peer.transcript.clear()
        single = rng.random() < 0.8
        self.peer.answer = self.peer.hostile(rng, 0.0 if single else RIGHT_SHARE)
        try:
            if single:
                await self._single(rng)
            else:
                operation = rng.choice((self._look, self._cycle, self._forces, self._count))
                await asyncio.wait_for(operation(rng), HANG_S)
        except DeviceError as error:
            if "\n" in str(error) or len(str(error)) > 1000:
                raise AssertionError(f"the error is no one line: {error!r}") from error
            return "refused"
        return "accepted"

    async def _single(self, rng: Random) -> None:
        """One request: what is accepted must have been sent, bit for bit, in a whole frame of the
        right kind."""
        part = rng.choice(self._parts)
        device, unit = part.device, part.settings.unit
        if isinstance(part, Sensor) or rng.random() < 0.3:
            count = rng.randint(1, 125)
            words = await asyncio.wait_for(device.read(100, count), HANG_S)
            expected = bytes([3, 2 * count]) + b"".join(word.to_bytes(2, "big") for word in words)
        elif rng.random() < 0.3:
            await asyncio.wait_for(device.write(part.write_block, [1, 2, 3]), HANG_S)
            expected = b"\x10\x00\xc8\x00\x03"
        else:
            words = await asyncio.wait_for(
                device.exchange(part.write_block, [1, 2, 3], part.read_block), HANG_S
            )
            expected = b"\x17\x1c" + b"".join(word.to_bytes(2, "big") for word in words)
        if (
            bytes(replace(self.peer.asked, length=None, unit=unit, body=expected))
            not in self.peer.sent
        ):
            raise AssertionError(f"accepted {expected.hex()}, which no frame of the peer's held")

    async def _look(self, rng: Random) -> None:
        await self.machine.look()

    async def _cycle(self, rng: Random) -> None:
        for number in range(3):
            await self.machine.cycle(number, lambda drive: drive.exchange(0.1))

    async def _forces(self, rng: Random) -> None:
        await self.machine.cuff_forces()

    async def _count(self, rng: Random) -> None:
        await self.machine.drives[0].count()


def hostile_rigs() -> list[RigSettings]:
    """Return the plain rig, with floats where it does not count, and all on one RTU line; all of
    little patience."""
    text = (datasets() / "rigs" / "plain.toml").read_text()
    patience = "".join(f"{key} = {TIMEOUT_S}\n" for key in ("watchdog_s", "connect_s", "control_s"))
    text = re.sub(r"^watchdog_s = [^#\n]*\n", patience, text, flags=re.MULTILINE)
    shared = re.sub(r"^(map = .*)$", r'\1\nline = "leg"', text, flags=re.MULTILINE)
    with TemporaryDirectory() as folder:
        return [
            _load(text, Path(folder)),
            _load(
                re.sub(r'^(?!sequence)(.*)"u?int32"', r'\1"float32"', text, flags=re.MULTILINE),
                Path(folder),
            ),
            _load(f'{shared}\n[line.leg]\ntransport = "rtu_over_tcp"\n', Path(folder)),
        ]


def _load(text: str, folder: Path) -> RigSettings:
    path = folder / "rig.toml"
    path.write_text(text)
    return load_rig(path)


async def fuzz(seed: int, inputs: int, only: int | None = None) -> Outcome:
    """Try so many replies; ``only`` one operation to see it again."""
    outcome = Outcome("replies", seed)
    errors = _listen_to_asyncio()
    rigs = hostile_rigs()
    clients = [
        Client(rigs[k % len(rigs)]) for k in range(SIDE_BY_SIDE if only is None else len(rigs))
    ]
    numbers = iter(range(1 << 60)) if only is None else iter([only] * len(rigs))
    before = peak_mib()

    async def work(client: Client) -> None:
        await client.open()
        for index in numbers:
            rng = Random(f"{seed}/{index}")
            began = time.perf_counter()
            try:
                what = await client.operate(rng)
            except Exception as error:  # whatever it is, it is what is looked for
                what = "failed"
                outcome.fail(index, repr(error), client.peer.transcript)
            outcome.count(what, time.perf_counter() - began)
            if errors:
                outcome.fail(
                    index,
                    f"within asyncio, of this input or a concurrent one: {errors.pop()}",
                    client.peer.transcript,
                )
            await client.renew()
            if sum(c.peer.answered for c in clients) >= inputs:
                break
        await client.end()

    await asyncio.gather(*(work(client) for client in clients))
    outcome.inputs = sum(client.peer.answered for client in clients)
    outcome.grown_mib = peak_mib() - before
    outcome.check_memory()
    return outcome


def _listen_to_asyncio() -> list[str]:
    """Return where it is noted what nobody waited for: asyncio would print it to the user as a
    traceback."""
    errors: list[str] = []

    def note(loop: asyncio.AbstractEventLoop, context: dict) -> None:
        errors.append(f"{context['message']} {context.get('exception')!r}")

    asyncio.get_running_loop().set_exception_handler(note)
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # as `exoid acquire` does
    return errors
