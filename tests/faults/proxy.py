"""A Modbus TCP proxy that lets a fault loose on the frames that pass through it."""

import asyncio
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass

HEADER = 7
"""Transaction id, protocol id, length, and the unit id that the length counts already."""


@dataclass(frozen=True)
class Frame:
    """One frame on its way, to the device or, a reply, from it."""

    raw: bytes
    is_reply: bool

    @property
    def transaction(self) -> int:
        return int.from_bytes(self.raw[0:2], "big")

    @property
    def unit(self) -> int:
        return self.raw[6]

    @property
    def function(self) -> int:
        return self.raw[7]

    @property
    def written(self) -> list[int]:
        """The registers that a request writes."""
        start = {16: 13, 23: 17}.get(self.function, len(self.raw)) if not self.is_reply else len(self.raw)
        return _words(self.raw[start:])

    @property
    def words(self) -> list[int]:
        """The registers in a reply to a reading function."""
        return _words(self.raw[9:])

    def with_bytes(self, place: int, new: bytes) -> bytes:
        """Return the frame with bytes replaced from a place on."""
        return self.raw[:place] + new + self.raw[place + len(new) :]

    def with_words(self, words: Iterable[int]) -> bytes:
        """Return the reply with other registers."""
        return self.raw[:9] + b"".join(word.to_bytes(2, "big") for word in words)


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

    def __init__(self, device_port: int, fault: Fault) -> None:
        self.port = 0
        self.written: dict[int, list[int]] = {}
        """Of each unit the words that it was told last."""
        self._device_port, self._fault = device_port, fault
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
        self._loop, self._until, self._links = asyncio.get_running_loop(), asyncio.Event(), set[asyncio.Task]()
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
                device_reader, device = await asyncio.open_connection("127.0.0.1", self._device_port)
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
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, link: Link, *, is_reply: bool
    ) -> None:
        while True:
            head = await reader.readexactly(HEADER)
            body = await reader.readexactly(int.from_bytes(head[4:6], "big") - 1)
            frame = Frame(head + body, is_reply)
            passing = list(self._fault(frame, link))
            for chunk in () if link.dead else passing:
                if frame.written and chunk == frame.raw:
                    self.written[frame.unit] = frame.written
                if isinstance(chunk, Late):
                    self._loop.call_later(chunk.seconds, writer.write, chunk.raw)
                else:
                    writer.write(chunk)
            await writer.drain()
