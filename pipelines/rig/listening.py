"""The Modbus server of a virtual rig's line, for any transport."""

import asyncio
import ssl
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import cast

from pymodbus.framer import FramerType
from pymodbus.pdu import ModbusPDU
from pymodbus.server import ModbusSerialServer, ModbusTcpServer, ModbusTlsServer
from pymodbus.simulator import SimDevice

from pipelines.errors import DeviceError, SettingsError
from pipelines.rig.guard import Functions, guarded
from pipelines.rig.null_modem import null_modem
from pipelines.settings.rig.line import (
    LineSettings,
    NetworkLine,
    RtuLine,
    RtuOverTcpLine,
    TlsLine,
    refuse_passphrase,
)


@asynccontextmanager
async def listening(
    line: LineSettings,
    devices: list[SimDevice],
    requests: Sequence[type[ModbusPDU]] = (),
    functions: Functions | None = None,
) -> AsyncIterator[str]:
    """Serve devices on a line for the duration of the block; yield the address for clients.

    Parameters
    ----------
    line : LineSettings
        A network line's ``host`` is the address to bind to, its ``port`` may be 0 for a free one. A
        serial line's port is a pseudo-terminal; its ``serial_port`` becomes a link to that, unless
        it is empty.
    devices : list of SimDevice
    requests : sequence of ModbusPDU types
        Requests that replace those of pymodbus.
    functions : mapping, optional
        Function codes that each unit knows; by default all.

    Raises
    ------
    DeviceError
        The address is in use.
    SettingsError
        A TLS line has no usable certificate.
    """
    if isinstance(line, RtuLine):
        with null_modem() as (ours, theirs), _linked(line.serial_port, theirs) as place:
            bus = ModbusSerialServer(
                devices, port=ours, baudrate=line.baud_rate, ignore_missing_devices=True
            )
            async with _serving(bus, place, requests, functions or {}):
                yield place
        return
    server = _network_server(line, devices)
    async with _serving(server, line.place, requests, functions or {}):
        # For port 0 the system has chosen the number, which clients need.
        number = cast(asyncio.Server, server.transport).sockets[0].getsockname()[1]
        yield f"{line.host}:{number}"


def _network_server(line: NetworkLine, devices: list[SimDevice]) -> ModbusTcpServer:
    address = (line.host, line.port)
    if isinstance(line, TlsLine):
        # pymodbus takes each TLS record for one whole frame, which TLS does not guarantee.
        return ModbusTlsServer(
            devices, framer=FramerType.SOCKET, address=address, sslctx=_tls_context(line)
        )
    # As on the bus behind a gateway, a missing device does not answer.
    if isinstance(line, RtuOverTcpLine):
        return ModbusTcpServer(
            devices, framer=FramerType.RTU, address=address, ignore_missing_devices=True
        )
    return ModbusTcpServer(devices, address=address)


@asynccontextmanager
async def _serving(
    server: ModbusTcpServer | ModbusSerialServer,
    place: str,
    requests: Sequence[type[ModbusPDU]],
    functions: Functions,
) -> AsyncIterator[None]:
    for request in requests:
        server.decoder.register(request)
    try:
        if not await guarded(server, functions).listen():
            raise DeviceError(f"{place}: cannot listen there; choose another --port or --bind")
        yield
    finally:
        for connection in server.active_connections.values():
            if connection.transport:  # without the closing handshake of TLS
                cast(asyncio.Transport, connection.transport).abort()
        await server.shutdown()
        await asyncio.sleep(0)  # the loop closes sockets in its next turn


@contextmanager
def _linked(wanted: str, port: str) -> Iterator[str]:
    """Link the ``wanted`` path to a port, unless it is empty; yield the path of the port."""
    if not wanted:
        yield port
        return
    link = Path(wanted)
    if link.is_symlink() and not link.exists():
        link.unlink()  # left by a killed rig
    try:
        link.symlink_to(port)
    except FileExistsError as error:
        raise DeviceError(
            f"{link}: exists already, where a virtual rig's link was to be. End the rig that made"
            " it, remove it, or name another path in serial_port"
        ) from error
    except OSError as error:
        raise DeviceError(
            f"{link}: cannot become the link to the virtual rig's pseudo-terminal"
            f" ({error.strerror}); name another path in serial_port, or ask for --port 0"
        ) from error
    try:
        yield wanted
    finally:
        link.unlink(missing_ok=True)


def _tls_context(line: TlsLine) -> ssl.SSLContext:
    """Return a TLS context with the rig's certificate; clients need one if the rig file has it."""
    if line.rig_certificate is None or line.rig_key is None:
        raise SettingsError("a virtual rig on a TLS line needs rig_certificate and rig_key")
    context, file = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), line.rig_certificate
    try:
        context.load_cert_chain(line.rig_certificate, line.rig_key, refuse_passphrase(line.rig_key))
        if line.certificate:
            context.verify_mode, file = ssl.CERT_REQUIRED, line.ca or line.certificate
            context.load_verify_locations(file)
    except OSError as error:  # SSLError is one
        raise SettingsError(
            f"{file}: is not a usable certificate ({error.strerror or error})"
        ) from error
    return context
