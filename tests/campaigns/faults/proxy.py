"""A proxy that lets a fault loose on the Modbus frames that pass through it, be they TCP's or
RTU's."""

import asyncio
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import ClassVar, Self

from pymodbus.framer import FramerRTU


@dataclass(frozen=True)
class Frame(ABC):
    """One frame on its way, to the device or, a reply, from it."""

    raw: bytes
    is_reply: bool
    HEAD: ClassVar[int]
    """Bytes before the unit id."""
    TAIL: ClassVar[int]
    """Bytes after the data."""

    @classmethod
    @abstractmethod
    async def read(cls, reader: asyncio.StreamReader, *, is_reply: bool) -> Self:
        """Wait for the next one."""

    @abstractmethod
    def with_body(self, body: bytes) -> bytes:
        """Return the frame with another unit id, function and data, sealed as a device would."""

    @property
    def body(self) -> bytes:
        """Unit id, function and data."""
        return self.raw[self.HEAD : len(self.raw) - self.TAIL]

    @property
    def unit(self) -> int:
        return self.body[0]

    @property
    def function(self) -> int:
        return self.body[1]

    @property
    def written(self) -> list[int]:
        """The registers that a request writes."""
        start = {16: 7, 23: 11}.get(self.function) if not self.is_reply else None
        return [] if start is None else _words(self.body[start:])

    @property
    def words(self) -> list[int]:
        """The registers in a reply to a reading function."""
        return _words(self.body[3:])

    def with_words(self, words: Iterable[int]) -> bytes:
        """Return the reply with other registers."""
        return self.with_body(self.body[:3] + b"".join(word.to_bytes(2, "big") for word in words))


class TcpFrame(Frame):
    """Transaction id, protocol id and length before the body."""

    HEAD, TAIL = 6, 0

    @classmethod
    async def read(cls, reader: asyncio.StreamReader, *, is_reply: bool) -> Self:
        head = await reader.readexactly(cls.HEAD)
        return cls(head + await reader.readexactly(int.from_bytes(head[4:6], "big")), is_reply)

    @property
    def transaction(self) -> int:
        return int.from_bytes(self.raw[0:2], "big")

    def with_body(self, body: bytes) -> bytes:
        return self.raw[:4] + len(body).to_bytes(2, "big") + body

    def with_head(self, place: int, new: bytes) -> bytes:
        """Return the frame with bytes of its head replaced from a place on."""
        return self.raw[:place] + new + self.raw[place + len(new) :]


class RtuFrame(Frame):
    """A checksum behind the body; its function determines the length."""

    HEAD, TAIL = 0, 2

    @classmethod
    async def read(cls, reader: asyncio.StreamReader, *, is_reply: bool) -> Self:
        raw = await reader.readexactly(2)
        if is_reply:
            fixed, counted = {16: (4, False), 3: (1, True), 23: (1, True)}.get(raw[1], (1, False))
        else:
            fixed, counted = {16: (5, True), 23: (9, True)}.get(raw[1], (4, False))
        raw += await reader.readexactly(fixed)
        return cls(raw + await reader.readexactly(cls.TAIL + (raw[-1] if counted else 0)), is_reply)

    def with_body(self, body: bytes) -> bytes:
        return body + FramerRTU.compute_CRC(body).to_bytes(2, "big")


def _words(raw: bytes) -> list[int]:
    return [int.from_bytes(raw[k : k + 2], "big") for k in range(0, len(raw), 2)]


@dataclass(frozen=True)
class Late:
    """Bytes that pass after a while."""

    raw: bytes
    seconds: float


class Link:
    """One connection of the client's, and what can befall it."""

    def __init__(self, client: asyncio.StreamWriter, device: asyncio.StreamWriter) -> None:
        self._client, self._device = client, device
        self.dead = False
        """Half open: it stands, but nothing passes any more."""

    def drop(self) -> None:
        """Break the connection, both ways at once."""
        for writer in (self._client, self._device):
            writer.transport.abort()


Fault = Callable[[Frame, Link], Iterable[bytes | Late]]
"""Returns what passes instead of a frame."""


class Proxy:
    """Listens on a port of its own for as long as the block lasts."""

    def __init__(self, device_port: int, fault: Fault, frames: type[Frame] = TcpFrame) -> None:
        self.port = 0
        self.written: dict[int, list[int]] = {}
        """Each unit's last written words."""
        self._device_port, self._fault, self._frames = device_port, fault, frames
        self._listening = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()))

    def __enter__(self) -> "Proxy":
        self._thread.start()
        assert self._listening.wait(30)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._until.set)
        self._thread.join()

    async def _serve(self) -> None:
        self._loop, self._until, self._links = (
            asyncio.get_running_loop(),
            asyncio.Event(),
            set[asyncio.Task](),
        )
        server = await asyncio.start_server(self._connected, "127.0.0.1", 0)
        self.port = server.sockets[0].getsockname()[1]
        self._listening.set()
        await self._until.wait()
        server.close()
        await asyncio.sleep(0)  # whoever was let in last begins, so that it can be ended
        for task in self._links:
            task.cancel()
        await asyncio.gather(*self._links, return_exceptions=True)
        await asyncio.sleep(0.01)  # what was aborted is closed by then

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task
        self._links.add(task)
        task.add_done_callback(self._links.discard)
        try:
            with suppress(OSError, asyncio.CancelledError):
                device_reader, device = await asyncio.open_connection(
                    "127.0.0.1", self._device_port
                )
                await self._pass_on(Link(writer, device), reader, device_reader, writer, device)
        finally:
            writer.transport.abort()

    async def _pass_on(
        self,
        link: Link,
        reader: asyncio.StreamReader,
        device_reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        device: asyncio.StreamWriter,
    ) -> None:
        """Pump both ways until one of them ends."""
        pumps = [
            asyncio.ensure_future(self._pump(reader, device, link, is_reply=False)),
            asyncio.ensure_future(self._pump(device_reader, writer, link, is_reply=True)),
        ]
        try:
            await asyncio.wait(pumps, return_when=asyncio.FIRST_COMPLETED)
        finally:
            link.drop()
            for pump in pumps:
                pump.cancel()
            await asyncio.gather(*pumps, return_exceptions=True)

    async def _pump(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        link: Link,
        *,
        is_reply: bool,
    ) -> None:
        while True:
            frame = await self._frames.read(reader, is_reply=is_reply)
            passing = list(self._fault(frame, link))
            for chunk in () if link.dead else passing:
                if frame.written and chunk == frame.raw:
                    self.written[frame.unit] = frame.written
                if isinstance(chunk, Late):
                    self._loop.call_later(chunk.seconds, writer.write, chunk.raw)
                else:
                    writer.write(chunk)
            await writer.drain()
