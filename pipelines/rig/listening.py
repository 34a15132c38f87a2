"""Where a virtual rig is reached: a Modbus server at the end of a line, whatever its transport."""

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
from pipelines.rig.guard import guarded
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
    line: LineSettings, devices: list[SimDevice], requests: Sequence[type[ModbusPDU]] = ()
) -> AsyncIterator[str]:
    """Serve devices on a line for as long as the block lasts; yields the place where clients find
    them.

    Parameters
    ----------
    line : LineSettings
        A network line's ``host`` is the address to bind to, its ``port`` may be 0 for a free one. A
        serial line's port is a pseudo-terminal; its ``serial_port`` becomes a link to that, unless
        it is empty.
    devices : list of SimDevice
    requests : sequence of ModbusPDU types
        Requests that are served otherwise than by pymodbus.

    Raises
    ------
    DeviceError
        The place is taken.
    SettingsError
        A TLS line names no certificate that could be shown.
    """
    if isinstance(line, RtuLine):
        with null_modem() as (ours, theirs), _linked(line.serial_port, theirs) as place:
            bus = ModbusSerialServer(
                devices, port=ours, baudrate=line.baud_rate, ignore_missing_devices=True
            )
            async with _serving(bus, place, requests):
                yield place
        return
    server = _network_server(line, devices)
    async with _serving(server, line.place, requests):
        number = cast(asyncio.Server, server.transport).sockets[0].getsockname()[1]
        yield f"{line.host}:{number}"


def _network_server(line: NetworkLine, devices: list[SimDevice]) -> ModbusTcpServer:
    address = (line.host, line.port)
    if isinstance(line, TlsLine):
        # pymodbus takes each record for one whole frame, whatever length the frame tells; records
        # do not promise that.
        return ModbusTlsServer(
            devices, framer=FramerType.SOCKET, address=address, sslctx=_tls_context(line)
        )
    # As on the bus behind a gateway, nobody answers for one who is not there.
    if isinstance(line, RtuOverTcpLine):
        return ModbusTcpServer(
            devices, framer=FramerType.RTU, address=address, ignore_missing_devices=True
        )
    return ModbusTcpServer(devices, address=address)


@asynccontextmanager
async def _serving(
    server: ModbusTcpServer | ModbusSerialServer, place: str, requests: Sequence[type[ModbusPDU]]
) -> AsyncIterator[None]:
    for request in requests:
        server.decoder.register(request)
    try:
        if not await guarded(server).listen():
            raise DeviceError(
                f"{place}: cannot listen there; choose a free port with --port, another address"
                " with --bind"
            )
        yield
    finally:
        for connection in server.active_connections.values():
            if connection.transport:  # at once: TLS would wait for the client to say goodbye
                cast(asyncio.Transport, connection.transport).abort()
        await server.shutdown()
        await asyncio.sleep(0)  # sockets are closed by the loop, one turn later


@contextmanager
def _linked(wanted: str, port: str) -> Iterator[str]:
    """Make a path lead to a port, if one is wanted; yields where the port is found."""
    if not wanted:
        yield port
        return
    link = Path(wanted)
    if link.is_symlink() and not link.exists():
        link.unlink()  # what a killed rig left
    try:
        link.symlink_to(port)
    except FileExistsError as error:
        raise DeviceError(
            f"{link}: {_what_is_there(link)}, or name another path in serial_port"
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


def _what_is_there(link: Path) -> str:
    # The system gives the number of a killed rig's port to others, so a link that leads somewhere
    # may be its leftover.
    if link.is_symlink():
        return (
            f"is a link to {link.readlink()} already, as a virtual rig makes one; end the rig that"
            " is served there or, if none is and a killed one left it, delete the link"
        )
    return (
        "is there already, where the link to the virtual rig's pseudo-terminal was to be; remove it"
    )


def _tls_context(line: TlsLine) -> ssl.SSLContext:
    """Return what the rig shows; it asks for a certificate where the rig file gives clients one to
    show."""
    if line.rig_certificate is None or line.rig_key is None:
        raise SettingsError(
            "a virtual rig on a TLS line shows a certificate too; give the line rig_certificate and"
            " rig_key"
        )
    context, file = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), line.rig_certificate
    try:
        context.load_cert_chain(line.rig_certificate, line.rig_key, refuse_passphrase(line.rig_key))
        if line.certificate:
            context.verify_mode, file = ssl.CERT_REQUIRED, line.ca or line.certificate
            context.load_verify_locations(file)
    except OSError as error:  # SSLError is one
        raise SettingsError(
            f"{file}: is no certificate that can be used ({error.strerror or error})"
        ) from error
    return context
