"""What the rig's end of a connection does about clients that mean harm."""

import asyncio
import socket
import struct

import pytest
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from pipelines.rig.guard import guarded

READ = struct.pack(">HHHBBHH", 7, 0, 6, 1, 3, 0, 100)


@pytest.fixture
def talk():
    """Serve unit 1 with 100 registers; runs ``client(connected socket, server)`` meanwhile."""

    def run(client):
        async def serving():
            device = SimDevice(
                1, simdata=[SimData(0, values=[0] * 100, datatype=DataType.REGISTERS)]
            )
            server = guarded(ModbusTcpServer([device], address=("127.0.0.1", 0)), {})
            assert await server.listen()
            line = socket.socket()
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
            line.setblocking(False)
            with line:
                loop = asyncio.get_running_loop()
                await loop.sock_connect(line, server.transport.sockets[0].getsockname())
                try:
                    return await asyncio.wait_for(client(loop, line, server), 20)
                finally:
                    await server.shutdown()

        return asyncio.run(serving())

    return run


def test_who_asks_and_never_fetches_is_hung_up_on(talk):
    async def greedy(loop, line, server):
        await asyncio.sleep(0.01)
        (handler,) = server.active_connections.values()
        handler.transport.get_extra_info("socket").setsockopt(
            socket.SOL_SOCKET, socket.SO_SNDBUF, 1
        )
        for _ in range(5_000):
            await loop.sock_sendall(line, READ)
            await asyncio.sleep(0.001)  # of requests that come together only the first is answered

    with pytest.raises(ConnectionError):
        talk(greedy)


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        (READ[:6] + b"\x09" + READ[7:], b"\x09\x83\x0b"),  # unit 9 is not there
        (READ[:10] + b"\xff\xff", b"\x01\x83\x03"),  # more registers than a reply can hold
        (READ[:4] + b"\x00\x03\x01\x63\x00", b"\x01\xe3\x03"),  # a function that nobody knows
    ],
)
def test_what_cannot_be_served_is_refused_as_the_specification_says(talk, request_, reply):
    async def asking(loop, line, server):
        await loop.sock_sendall(line, request_)
        return await loop.sock_recv(line, 100)

    assert talk(asking)[6:] == reply
