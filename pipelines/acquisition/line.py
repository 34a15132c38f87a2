"""A line to devices: one connection, one request at a time however many devices are on it, and quiet in between."""

import asyncio
import errno
import ssl
import sys
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

import serial
from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient, AsyncModbusTlsClient
from pymodbus.client.base import ModbusBaseClient
from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.framer import FramerSocket, FramerType
from pymodbus.pdu import DecodePDU, ModbusPDU
from serial.tools import list_ports

from pipelines.acquisition.reply import check_replies
from pipelines.errors import DeviceError, SettingsError
from pipelines.settings.line import LineSettings, RtuLine, RtuOverTcpLine, TlsLine
from pipelines.settings.rig import DeviceSettings, RigSettings

BAD_SETTINGS: tuple[type[Exception], ...] = (ValueError,)
"""What a serial port that cannot be set up as told is refused with."""
with suppress(ImportError):  # Windows has another way with ports
    import termios

    BAD_SETTINGS += (termios.error,)


class Line:
    """A connection and whoever is on it."""

    def __init__(self, settings: LineSettings, timeout_s: float, name: str | None = None) -> None:
        self.place = settings.place
        self.client = _client(settings, timeout_s, self._told)
        self.client.set_max_no_responses(sys.maxsize)  # the watchdog decides for how long silence is borne
        self._conversation = check_replies(self.client)
        self.devices: list[str] = []
        """Who is on it."""
        self._settings, self._timeout_s, self._name = settings, timeout_s, name
        self._turn = asyncio.Lock()
        self._asking = False
        self._unanswered_s: float | None = None
        """How long the last request was awaited in vain; None where it was answered."""
        self._quiet_since = 0.0

    @property
    def tells_replies_apart(self) -> bool:
        """Whether a reply names the request that it answers; on a serial line none does."""
        return not isinstance(self._settings, RtuLine | RtuOverTcpLine)

    def join(self, name: str, unit: int) -> str:
        """Add a device; return what errors call it."""
        label = f"{name} ({self.place}, unit {unit})"
        self.devices.append(f"{name} (unit {unit})" if self._name else label)
        return label

    async def connect(self) -> None:
        """Open the connection; nothing happens where there is one."""
        async with self._turn:
            await self._open()

    async def _open(self) -> None:
        if not self.client.connected and not await self._connected():
            raise DeviceError(f"{self._label}: {await self._refusal()}")

    async def _connected(self) -> bool:
        self.client.ctx.comm_params.timeout_connect = self._timeout_s
        try:
            return await self.client.connect()
        except BAD_SETTINGS as error:
            raise DeviceError(
                f"{self._label}: the serial port cannot be set up like that ({error}); correct baud_rate, parity or "
                'stop_bits in the rig file (a pseudo-terminal needs parity = "none")'
            ) from error

    def close(self) -> None:
        """Close the connection; nothing happens where there is none."""
        if self.client.ctx.transport:
            # At once: TLS would wait for the other end to say goodbye, and that may be gone.
            cast(asyncio.Transport, self.client.ctx.transport).abort()
        self.client.close()

    async def renew(self) -> None:
        """Open another connection where this one did not answer last, once whoever is asking has been answered.

        Nobody's turn comes in between: whoever else is on the line is asked on the old connection or the new one.
        """
        async with self._turn:
            if self._unanswered_s is None:
                return
            self.close()
            await self._open()
            self._unanswered_s = None

    async def ask(self, within_s: float, request: Callable[..., Awaitable[ModbusPDU]], **arguments: Any) -> ModbusPDU:
        """Send a request of the client's when it is its turn, and return the answer, awaited for ``within_s``.

        Raises
        ------
        DeviceError
            The line is lost.
        ModbusException, OSError
            The device did not answer; the line stands.
        """
        async with self._turn:
            if self._unanswered_s is not None and not self.tells_replies_apart and self.client.connected:
                await self._let_pass(self._unanswered_s)
            await self._quiet()
            # The one place where pymodbus looks for how long to wait, be it for a connection or for an answer.
            self.client.ctx.comm_params.timeout_connect = within_s
            self._asking, self._unanswered_s = True, within_s
            try:
                answer = await request(**arguments)
                self._unanswered_s = None
                return answer
            except (ModbusException, OSError) as error:
                if self.client.connected:
                    raise
                others = f", and with it {', '.join(self.devices)}" if self._name else ""
                raise DeviceError(f"{self._label}: the line is lost{others}; check cable and power") from error
            finally:
                self._asking = False
                self._quiet_since = asyncio.get_running_loop().time()

    @property
    def _label(self) -> str:
        return f"line {self._name} ({self.place})" if self._name else self.devices[0]

    async def _let_pass(self, within_s: float) -> None:
        """Wait for the reply that did not come in time, lest it be taken for the next one's."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._conversation.replied.wait(), within_s)
            self._quiet_since = asyncio.get_running_loop().time()

    async def _quiet(self) -> None:
        """Wait until nothing has been on the line for as long as its devices need to tell frames apart."""
        if self._settings.quiet_s:
            loop = asyncio.get_running_loop()
            await asyncio.sleep(max(0.0, self._quiet_since + self._settings.quiet_s - loop.time()))

    def _told(self, connected: bool) -> None:
        """End the request that is under way when the connection ends: its answer will not come."""
        answer = self.client.ctx.response_future
        if self._asking and not connected and not answer.done():
            answer.set_exception(ConnectionException("lost"))

    async def _refusal(self) -> str:
        """Return why there is no connection; the client tells its log alone."""
        try:
            if isinstance(self._settings, RtuLine):
                serial.Serial(self.place, exclusive=True).close()
            elif isinstance(self._settings, TlsLine):
                opening = asyncio.open_connection(
                    self._settings.host, self._settings.port, ssl=_tls_context(self._settings)
                )
                _, writer = await asyncio.wait_for(opening, self._timeout_s)
                writer.close()
        except OSError as error:
            return _explained(error)
        return "refuses the connection; check that the rig is on, and host and port in the rig file"


def lines_of(rig: RigSettings) -> Callable[[DeviceSettings], Line]:
    """Return what finds the line that a device of a rig is on, the same one for all devices that share it."""
    timeout_s = rig.safety.connect_s
    shared = {name: Line(settings, timeout_s, name) for name, settings in rig.line.items()}
    return lambda device: shared[device.line] if device.line is not None else Line(rig.line_of(device), timeout_s)


def _client(settings: LineSettings, timeout_s: float, told: Callable[[bool], None]) -> ModbusBaseClient:
    """Return the client of a line, not yet connected."""
    # Never a second try: a set-point that comes late is no set-point, and an exchange may move the leg.
    common: Mapping[str, Any] = {"timeout": timeout_s, "retries": 0, "reconnect_delay": 0, "trace_connect": told}
    if isinstance(settings, RtuLine):
        return AsyncModbusSerialClient(
            settings.serial_port, baudrate=settings.baud_rate, parity=settings.parity[0].upper(),
            stopbits=settings.stop_bits, **common,
        )  # fmt: skip
    if isinstance(settings, TlsLine):
        client = AsyncModbusTlsClient(settings.host, port=settings.port, sslctx=_tls_context(settings), **common)
        # pymodbus takes each record for one whole frame, whatever length the frame tells; records do not promise that.
        client.ctx.framer = FramerSocket(DecodePDU(False))
        return client
    framer = FramerType.RTU if isinstance(settings, RtuOverTcpLine) else FramerType.SOCKET
    return AsyncModbusTcpClient(settings.host, port=settings.port, framer=framer, **common)


def _tls_context(settings: TlsLine) -> ssl.SSLContext:
    """Return what a line shows and what it trusts."""
    file: Path | None = settings.ca
    try:
        context = ssl.create_default_context(cafile=settings.ca)
        if settings.certificate:
            file = settings.certificate
            context.load_cert_chain(settings.certificate, settings.key)
    except OSError as error:  # SSLError is one
        raise SettingsError(
            f"{file}: is no certificate that can be used ({error.strerror or error}); give PEM files, the key without "
            "a passphrase"
        ) from error
    return context


def _explained(error: OSError) -> str:
    """Return a failure to connect in words, with what to do."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return (
            f"its certificate is not to be trusted ({error.verify_message.rstrip('.')}); name in ca whoever signed it, "
            "and in host the name that it is made out to"
        )
    if isinstance(error, TimeoutError):
        return "no TLS connection within safety.connect_s; check that the rig is on, and that the port speaks TLS"
    if isinstance(error, ssl.SSLError):
        return f"no TLS connection ({error.reason or error}); check that the port speaks TLS, and certificate and key"
    if error.errno == errno.ENOENT:
        there = ", ".join(sorted(port.device for port in list_ports.comports())) or "none"
        return f"no such serial port; there is {there}; plug the adapter in, or correct serial_port in the rig file"
    if error.errno in (errno.EACCES, errno.EPERM):
        return (
            "no permission for the serial port; on Linux join its group (sudo usermod -aG dialout $USER), log in anew"
        )
    if error.errno in (errno.EBUSY, errno.EAGAIN):
        return "the serial port is busy; end the other program that uses it"
    return f"no connection ({error}); check that the rig is on, and the line in the rig file"
