"""A Modbus TCP server with the manners of devices as they are sold, for tests of lines."""

import asyncio
import socket
import struct
from contextlib import asynccontextmanager

from pymodbus.framer import FramerRTU


def crc(frame):
    return FramerRTU.compute_CRC(frame).to_bytes(2, "big")


def in_rtu(unit, pdu):
    return bytes([unit]) + pdu + crc(bytes([unit]) + pdu)


def in_tcp(transaction, unit, pdu):
    return struct.pack(">HHHB", transaction, 0, len(pdu) + 1, unit) + pdu


def swapped(number):
    return int.from_bytes(number.to_bytes(2, "big"), "little")


def ok(transaction, unit, pdu, frame):
    return in_tcp(transaction, unit, pdu)


MANNERS = {
    "ok": ok,
    "unit 0": lambda t, u, pdu, frame: in_tcp(t, 0, pdu),
    "swapped": lambda t, u, pdu, frame: in_tcp(swapped(t), u, pdu),
    "raw": lambda t, u, pdu, frame: in_rtu(u, pdu),
    "garbled": lambda t, u, pdu, frame: bytes.fromhex("9f3c00ff8b1e77a0c4d210"),
    "web": lambda t, u, pdu, frame: b"HTTP/1.1 400 Bad Request\r\n\r\n",
    "short": lambda t, u, pdu, frame: in_tcp(t, u, pdu)[:-1],
    "silent": lambda t, u, pdu, frame: b"",
}


def answer(pdu):
    """Answer FC03 and FC04 with each register's own address, FC06 and FC16 as they should be."""
    function, address, count = struct.unpack(">BHH", pdu[:5])
    if function in (3, 4):
        words = range(address, address + count)
        return struct.pack(f">BB{count}H", function, 2 * count, *words)
    return pdu[:5]


class Server:
    """Serves ``manner`` over TCP frames, or RTU frames with or without an echo.

    ``clients`` is how many connections are served at once: of more, the others are not answered;
    with ``newest`` the earlier ones are closed. A connection ends after ``answers``, with ``reset``
    without notice.
    """

    def __init__(
        self,
        manner="ok",
        *,
        rtu=None,
        closes=False,
        clients=99,
        newest=False,
        slow=0.0,
        answers=None,
        reset=False,
    ):
        self.manner, self.rtu, self.slow = manner, rtu, slow
        self.answers, self.reset = 1 if closes else answers, reset
        self.clients, self.newest = clients, newest
        self.open, self.connections, self.requests = [], 0, []

    async def serve(self, reader, writer):
        self.connections += 1
        if self.newest:
            for other in self.open:
                other.close()
            self.open.clear()
        self.open.append(writer)
        is_served = len(self.open) <= self.clients
        answered = 0
        try:
            while answered != self.answers:
                reply = await (self._rtu(reader) if self.rtu else self._tcp(reader))
                if is_served:
                    await self._send(writer, reply)
                answered += 1
        except (asyncio.IncompleteReadError, ConnectionError, asyncio.CancelledError):
            pass
        finally:
            if writer in self.open:
                self.open.remove(writer)
            if self.reset:
                await asyncio.sleep(0.02)  # the last answer arrives first
                linger = struct.pack("ii", 1, 0)
                writer.get_extra_info("socket").setsockopt(
                    socket.SOL_SOCKET, socket.SO_LINGER, linger
                )
                writer.transport.abort()
            writer.close()

    async def _send(self, writer, reply):
        pieces = [reply[i : i + 1] for i in range(len(reply))] if self.slow else [reply]
        for piece in pieces:
            writer.write(piece)
            await writer.drain()
            await asyncio.sleep(self.slow)

    async def _tcp(self, reader):
        head = await reader.readexactly(7)
        transaction, _, length, unit = struct.unpack(">HHHB", head)
        pdu = await reader.readexactly(length - 1)
        self.requests.append((unit, pdu[0]))
        return MANNERS[self.manner](transaction, unit, answer(pdu), head + pdu)

    async def _rtu(self, reader):
        frame = await reader.readexactly(8)
        if frame[1] == 16:
            frame += await reader.readexactly(1 + frame[6])
        self.requests.append((frame[0], frame[1]))
        reply = in_rtu(frame[0], answer(frame[1:-2]))
        return frame + reply if self.rtu == "echo" else frame if self.rtu == "dead" else reply


@asynccontextmanager
async def serving(*arguments, **options):
    """Serve while the block lasts; yield the server and its port."""
    server = Server(*arguments, **options)
    tcp = await asyncio.start_server(server.serve, "127.0.0.1", 0)
    try:
        yield server, tcp.sockets[0].getsockname()[1]
    finally:
        tcp.close()
