"""A line to devices: one connection, one request at a time however many devices are on it, and
quiet in between."""

import asyncio
import errno
import socket
import ssl
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, cast

import serial
from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient, AsyncModbusTlsClient
from pymodbus.client.base import ModbusBaseClient
from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.framer import FramerSocket, FramerType
from pymodbus.pdu import DecodePDU, ModbusPDU
from serial.tools import list_ports

from pipelines.acquisition.modbus.reply import NoReply, check_replies
from pipelines.errors import DeviceError, SettingsError
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import DeviceSettings
from pipelines.settings.rig.line import (
    LineSettings,
    NetworkLine,
    RtuLine,
    RtuOverTcpLine,
    TlsLine,
    refuse_passphrase,
)

BAD_SETTINGS: tuple[type[Exception], ...] = (ValueError,)
"""What a serial port that cannot be set up as told is refused with."""
with suppress(ImportError):  # Windows has another way with ports
    import termios

    BAD_SETTINGS += (termios.error,)


CERTIFICATE_ADVICE = {
    9: "set the clocks of this computer and of the rig, or wait until it is valid",
    10: "renew it at the rig, or set this computer's clock if that is wrong",
}
"""What to do about a certificate that OpenSSL refuses by a code of its own, where it is no matter
of whom to trust."""


class Owed:
    """An answer that did not come in time, and may still come."""

    def __init__(self, within_s: float) -> None:
        self._until = asyncio.get_running_loop().time() + within_s
        self.came = asyncio.Event()

    async def pass_by(self) -> None:
        """Wait until it has come, or comes no more."""
        with suppress(TimeoutError):
            async with asyncio.timeout_at(self._until):
                await self.came.wait()


class Line:
    """A connection and whoever is on it."""

    def __init__(self, settings: LineSettings, timeout_s: float, name: str | None = None) -> None:
        self.place = settings.place
        # Once: files are read, and a lost connection is no time for that.
        self._tls = _tls_context(settings) if isinstance(settings, TlsLine) else None
        self.client = _client(settings, self._tls, timeout_s, self._note_connection)
        # The watchdog decides for how long silence is borne.
        self.client.set_max_no_responses(sys.maxsize)
        check_replies(self.client, self._note_reply)
        self.devices: list[str] = []
        """Who is on it."""
        self._settings, self._timeout_s, self._name = settings, timeout_s, name
        self._turn = asyncio.Lock()
        self._holder: asyncio.Task | None = None
        """Whose turn it is."""
        self._used = False
        """Whether anything was asked in it."""
        self._asking = self._failed = self._has_answered = False
        """Whether a request is under way, whether the last one was not answered, and whether any
        ever was."""
        self._asked: dict[int, float] = {}
        """Units that have not answered yet, or are waiting for their turn, and since when; the
        event loop's time, s."""
        self._owed: dict[int, Owed] = {}
        """What units may still answer that were not waited for any longer."""
        self._quiet_since = 0.0

    @property
    def has_transaction_ids(self) -> bool:
        """Whether a reply names the request that it answers."""
        return self._settings.has_transaction_ids

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
                f"{self._label}: the serial port cannot be set up like that ({error}); correct"
                " baud_rate, parity or stop_bits in the rig file (a pseudo-terminal needs parity ="
                ' "none")'
            ) from error

    def close(self) -> None:
        """Close the connection; nothing happens where there is none."""
        if self.client.ctx.transport:
            # At once: TLS would wait for the other end to say goodbye, and that may be gone.
            cast(asyncio.Transport, self.client.ctx.transport).abort()
        self.client.close()

    async def renew(self) -> None:
        """Open another connection where this one did not answer last, once whoever is asking has
        been answered.

        Nobody's turn comes in between: whoever else is on the line is asked on the old connection
        or the new one.
        """
        async with self._turn:
            if not self._failed:
                return
            self.close()
            await self._open()
            self._failed = False
            for owed in self._owed.values():
                owed.came.set()
            self._owed.clear()

    @asynccontextmanager
    async def turn(self, unit: int) -> AsyncIterator[None]:
        """Wait until it is a unit's turn, and keep it for all that this task asks within."""
        waits = unit not in self._asked
        self._asked.setdefault(unit, asyncio.get_running_loop().time())
        await self._take_turn(unit)
        self._holder, self._used = asyncio.current_task(), False
        try:
            yield
        finally:
            if waits and not self._used:
                self._asked.pop(unit, None)
            self._holder = None
            self._turn.release()

    async def ask(
        self,
        unit: int,
        within_s: float,
        request: Callable[..., Awaitable[ModbusPDU]],
        **arguments: Any,
    ) -> ModbusPDU:
        """Send a unit a request of the client's when it is its turn, and return the answer, awaited
        for ``within_s``.

        Raises
        ------
        DeviceError
            The line is lost.
        ModbusException, OSError
            The device did not answer; the line stands.
        """
        if self._holder is asyncio.current_task():
            return await self._ask(unit, within_s, request, arguments)
        async with self.turn(unit):
            return await self._ask(unit, within_s, request, arguments)

    async def _ask(
        self,
        unit: int,
        within_s: float,
        request: Callable[..., Awaitable[ModbusPDU]],
        arguments: dict[str, Any],
    ) -> ModbusPDU:
        self._used = True
        self._asked.setdefault(unit, asyncio.get_running_loop().time())
        try:
            await self._quiet()
            # The one place where pymodbus looks for how long to wait, be it for a connection or for
            # an answer.
            self.client.ctx.comm_params.timeout_connect = within_s
            self._asking = self._failed = True
            answer = await request(**arguments, device_id=unit)
            # What answers another request is no silence; but who asks again is to do so on another
            # connection.
            self._failed, self._has_answered = isinstance(answer, NoReply), True
            self._asked.pop(unit, None)
            return answer
        except (ModbusException, OSError) as error:
            if self.client.connected:
                raise
            raise DeviceError(f"{self._label}: {self._loss()}") from error
        finally:
            if self._asking:
                self._quiet_since = asyncio.get_running_loop().time()
                if unit in self._asked and (len(self.devices) > 1 or not self.has_transaction_ids):
                    self._owed[unit] = Owed(within_s)
            self._asking = False

    def awaited_s(self, unit: int) -> float:
        """Return for how long a unit has not answered what it is to be asked, s; 0 where it has."""
        now = asyncio.get_running_loop().time()
        return now - self._asked.get(unit, now)

    async def _take_turn(self, unit: int) -> None:
        """Wait until a unit may be asked.

        After one that did not answer come the others on the line, for as long as it was waited for:
        one that is dead must not keep them from being told where to go. A serial line does not say
        which request a reply answers: a late one has come by then.
        """
        while True:
            if owed := self._owed.get(unit):
                await owed.pass_by()
                if self._owed.get(unit) is owed:
                    del self._owed[unit]
            await self._turn.acquire()
            if unit not in self._owed:
                return
            self._turn.release()

    def _note_reply(self, unit: int) -> None:
        """Note that a unit has replied, in time or not."""
        self._quiet_since = asyncio.get_running_loop().time()
        if owed := self._owed.get(unit):
            owed.came.set()

    @property
    def _label(self) -> str:
        return f"line {self._name} ({self.place})" if self._name else self.devices[0]

    async def _quiet(self) -> None:
        """Wait until nothing has been on the line for as long as its devices need to tell frames
        apart."""
        if self._settings.quiet_s:
            loop = asyncio.get_running_loop()
            await asyncio.sleep(max(0.0, self._quiet_since + self._settings.quiet_s - loop.time()))

    def _note_connection(self, connected: bool) -> None:
        """End the request that is under way when the connection ends: its answer will not come."""
        answer = self.client.ctx.response_future
        if self._asking and not connected and not answer.done():
            answer.set_exception(ConnectionException("lost"))

    def _loss(self) -> str:
        """Return what became of the connection, and for whom."""
        others = f", and with it {', '.join(self.devices)}" if self._name else ""
        # Under TLS 1.3 a client is turned away only once it takes the connection for made.
        if isinstance(self._settings, TlsLine) and not self._has_answered:
            return (
                f"the other end closed the line before its first answer{others}; it does not trust"
                " what certificate and key in the rig file show, or has stopped"
            )
        return f"the line is lost{others}; check cable and power"

    async def _refusal(self) -> str:
        """Return why there is no connection; the client tells its log alone."""
        try:
            if isinstance(self._settings, NetworkLine):
                await asyncio.get_running_loop().getaddrinfo(
                    self._settings.host, self._settings.port
                )
            if isinstance(self._settings, RtuLine):
                serial.Serial(self.place, exclusive=True).close()
            elif isinstance(self._settings, TlsLine):
                opening = asyncio.open_connection(
                    self._settings.host, self._settings.port, ssl=self._tls
                )
                _, writer = await asyncio.wait_for(opening, self._timeout_s)
                writer.close()
        except OSError as error:
            return _explained(error)
        return "refuses the connection; check that the rig is on, and host and port in the rig file"


def lines_of(rig: RigSettings) -> Callable[[DeviceSettings], Line]:
    """Return what finds the line that a device of a rig is on, the same one for all devices that
    share it."""
    timeout_s = rig.safety.connect_s
    shared = {name: Line(settings, timeout_s, name) for name, settings in rig.line.items()}
    return lambda device: (
        shared[device.line] if device.line is not None else Line(rig.line_of(device), timeout_s)
    )


def _client(
    settings: LineSettings,
    tls: ssl.SSLContext | None,
    timeout_s: float,
    note: Callable[[bool], None],
) -> ModbusBaseClient:
    """Return the client of a line, not yet connected."""
    # Never a second try: a set-point that comes late is no set-point, and an exchange may move the
    # leg.
    common: Mapping[str, Any] = {
        "timeout": timeout_s,
        "retries": 0,
        "reconnect_delay": 0,
        "trace_connect": note,
    }
    if isinstance(settings, RtuLine):
        return AsyncModbusSerialClient(
            settings.serial_port,
            baudrate=settings.baud_rate,
            parity=settings.parity[0].upper(),
            stopbits=settings.stop_bits,
            **common,
        )
    if isinstance(settings, TlsLine):
        assert tls  # such a line has one
        client = AsyncModbusTlsClient(settings.host, port=settings.port, sslctx=tls, **common)
        # pymodbus takes each record for one whole frame, whatever length the frame tells; records
        # do not promise that.
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
            context.load_cert_chain(
                settings.certificate, settings.key, refuse_passphrase(settings.key)
            )
    except OSError as error:  # SSLError is one
        raise SettingsError(
            f"{file}: is no certificate that can be used ({error.strerror or error}); give PEM"
            " files"
        ) from error
    return context


def _explained(error: OSError) -> str:
    """Return a failure to connect in words, with what to do."""
    if isinstance(error, socket.gaierror):
        return f"no such host ({error.strerror}); correct host in the rig file, or give its address"
    if isinstance(error, ssl.SSLCertVerificationError):
        advice = CERTIFICATE_ADVICE.get(
            error.verify_code,
            "name in ca whoever signed it, and in host the name that it is made out to",
        )
        return (
            f"its certificate is not to be trusted ({error.verify_message.rstrip('.')}); {advice}"
        )
    if isinstance(error, TimeoutError):
        return (
            "no TLS connection within safety.connect_s; check that the rig is on, and that the port"
            " speaks TLS"
        )
    if isinstance(error, ssl.SSLError):
        return (
            f"no TLS connection ({error.reason or error}); check that the port speaks TLS, and"
            " certificate and key"
        )
    if error.errno == errno.ENOENT:
        there = ", ".join(sorted(port.device for port in list_ports.comports())) or "none"
        return (
            f"no such serial port; there is {there}; plug the adapter in, or correct serial_port in"
            " the rig file"
        )
    if error.errno in (errno.EACCES, errno.EPERM):
        return (
            "no permission for the serial port; on Linux join its group (sudo usermod -aG dialout"
            " $USER), log in anew"
        )
    if error.errno in (errno.EBUSY, errno.EAGAIN):
        return "the serial port is busy; end the other program that uses it"
    return f"no connection ({error}); check that the rig is on, and the line in the rig file"
