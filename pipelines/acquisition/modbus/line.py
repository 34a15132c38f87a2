"""A line to devices: one connection, with one request at a time and pauses in between."""

import asyncio
import ssl
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any, cast

import serial
from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.pdu import ModbusPDU

from pipelines.acquisition.modbus.connection import client_of, explain, tls_context
from pipelines.acquisition.modbus.framing import Traffic
from pipelines.acquisition.modbus.reply import InvalidReply, check_replies
from pipelines.acquisition.modbus.unexpected import as_hex
from pipelines.errors import DeviceError, Disconnected
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import DeviceSettings
from pipelines.settings.rig.line import LineSettings, NetworkLine, RtuLine, TlsLine
from pipelines.settings.rig.recording_only import RecordingRig

Send = Callable[[], Awaitable[ModbusPDU]]
"""Sends a request, and returns the reply."""
BAD_SETTINGS: tuple[type[Exception], ...] = (ValueError,)
"""Errors of a serial port that cannot be set up as the rig file says."""
with suppress(ImportError):  # not on Windows
    import termios

    BAD_SETTINGS += (termios.error,)


class LateReply:
    """A reply that did not come in time, and may still come."""

    def __init__(self, within_s: float) -> None:
        self._until = asyncio.get_running_loop().time() + within_s
        self.came = asyncio.Event()

    async def wait(self) -> None:
        """Wait until it has come, or can come no more."""
        with suppress(TimeoutError):
            async with asyncio.timeout_at(self._until):
                await self.came.wait()


class Line:
    """A connection and the devices on it."""

    def __init__(self, settings: LineSettings, timeout_s: float, name: str | None = None) -> None:
        self.place = settings.place
        # Only once: it reads files, which must not delay a new connection.
        self._tls = tls_context(settings) if isinstance(settings, TlsLine) else None
        self.client = client_of(settings, self._tls, timeout_s, self._note_connection)
        # Else pymodbus closes the connection after some missing replies; the watchdog decides that.
        self.client.set_max_no_responses(sys.maxsize)
        self._ended_by: Exception | None = None
        """Error with which the system ended the connection; None where the other end closed it."""
        self._note_why_it_ends()
        self.traffic = Traffic()
        check_replies(self.client, not settings.has_transaction_ids, self.traffic, self._note_reply)
        self.devices: list[str] = []
        """Names of the devices on it."""
        self.settings, self._timeout_s, self._name = settings, timeout_s, name
        self._turn = asyncio.Lock()
        self._holder: asyncio.Task | None = None
        """Task that has the turn."""
        self._used = False
        """Whether it has sent a request in its turn."""
        self._asking = self._failed = False
        """Whether a request is under way, and whether the last one was not answered."""
        self.has_answered = False
        """Whether any request was ever answered."""
        self.takes_one_client = False
        """Whether the other end serves no second connection."""
        self.reopens = False
        """Whether a lost connection is opened again: only where nothing is moved or written."""
        self._reopened = 0
        """How often it was."""
        self._answers = 0
        """Answers on this connection."""
        self._closes: bool | None = None
        """Whether the other end closes a connection after one answer; None until that shows."""
        self._asked: dict[int, float] = {}
        """Event loop's time, s, since when a unit waits for its turn or its reply."""
        self._late: dict[int, LateReply] = {}
        """Replies that units may still send after their time-out."""
        self._quiet_since = 0.0

    @property
    def has_transaction_ids(self) -> bool:
        """Whether a reply names the request that it answers."""
        return self.settings.has_transaction_ids

    def join(self, name: str, unit: int) -> str:
        """Add a device; return its label in errors."""
        label = f"{name} ({self.place}, unit {unit})"
        self.devices.append(f"{name} (unit {unit})" if self._name else label)
        return label

    async def connect(self) -> None:
        """Open the connection, if it is not open."""
        async with self._turn:
            await self._open()

    @property
    def _is_open(self) -> bool:
        """Whether there is a connection, as far as known."""
        if self.has_answered or not self.client.connected:
            return self.client.connected
        # pymodbus takes a connection for open that the other end closed as soon as it was there,
        # and waits for an answer on it.
        transport = cast(asyncio.Transport | None, self.client.ctx.transport)
        return transport is None or not transport.is_closing()

    async def _open(self, within_s: float | None = None) -> None:
        if self._is_open:
            return
        self._answers = 0
        self.client.ctx.comm_params.timeout_connect = within_s or self._timeout_s
        try:
            is_open = await self.client.connect()
        except BAD_SETTINGS as error:
            raise DeviceError(
                f"{self.label}: the serial port cannot be set up like that ({error}); correct"
                " baud_rate, parity or stop_bits in the rig file (a pseudo-terminal needs parity ="
                ' "none")'
            ) from error
        if not is_open:
            raise Disconnected(f"{self.label}: {await self._refusal()}")
        if not self._is_open:
            self.close()
            raise Disconnected(f"{self.label}: {self._loss()}")

    def close(self) -> None:
        """Close the connection, if it is open."""
        self._answers = 0  # so that this end is not taken for the other's
        if self.client.ctx.transport:
            # Without the closing handshake of TLS: the other end may be gone.
            cast(asyncio.Transport, self.client.ctx.transport).abort()
        self.client.close()

    async def renew(self) -> None:
        """Open a new connection where the last request on this one was not answered.

        It waits for the request that is under way, and no device's turn comes in between.
        """
        async with self._turn:
            if not self._failed:
                return
            self.close()
            await self._open()
            self._failed = False
            for late in self._late.values():
                # A reply on the old connection can come no more.
                late.came.set()
            self._late.clear()

    @asynccontextmanager
    async def turn(self, unit: int) -> AsyncIterator[None]:
        """Wait for a unit's turn, and keep it for all requests of this task within the block."""
        waits = unit not in self._asked
        self._asked.setdefault(unit, asyncio.get_running_loop().time())
        await self._take_turn(unit)
        self._holder, self._used = asyncio.current_task(), False
        try:
            yield
        finally:
            # A turn in which nothing was asked leaves no reply to await.
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
        """Send a request to a unit in its turn, and return the reply, awaited for ``within_s``.

        Raises
        ------
        DeviceError
            The line is lost.
        ModbusException, OSError
            The device did not answer, but the line is open.
        """
        send = partial(request, **arguments, device_id=unit)
        if self._holder is asyncio.current_task():
            return await self._ask(unit, within_s, send)
        async with self.turn(unit):
            return await self._ask(unit, within_s, send)

    async def _ask(self, unit: int, within_s: float, send: Send) -> ModbusPDU:
        self._used = True
        self._asked.setdefault(unit, asyncio.get_running_loop().time())
        try:
            try:
                answer = await self._send(within_s, send)
            except (ModbusException, OSError):
                if self.client.connected or self.traffic.came or not self._answers:
                    raise
                # The request may have met a connection that ends after its first answer.
                if self._answers == 1 and self._closes is None:
                    self._closes = True
                if not (self._closes or self.reopens):
                    raise
                answer = await self._send(within_s, send)
            self._answers += 1
            if self._answers == 2:
                self._closes = False
            # The reply to another request counts as an answer, but the next try needs a new
            # connection.
            self._failed, self.has_answered = isinstance(answer, InvalidReply), True
            self._asked.pop(unit, None)
            return answer
        except (ModbusException, OSError) as error:
            if self.client.connected:
                raise
            raise Disconnected(f"{self.label}: {self._loss()}") from error
        finally:
            if self._asking:
                self._quiet_since = asyncio.get_running_loop().time()
                # On a line of its own with transaction ids, a late reply is recognised and does no
                # harm.
                if unit in self._asked and (len(self.devices) > 1 or not self.has_transaction_ids):
                    self._late[unit] = LateReply(within_s)
            self._asking = False

    async def _send(self, within_s: float, send: Send) -> ModbusPDU:
        """Send a request, on a new connection where each takes one only, or one was lost."""
        lost = self.reopens and not self.client.connected
        if self._closes or lost:
            self._reopened += lost and not self._closes
            self.close()
            await self._open(within_s)
        elif not self.has_answered:
            await self._open(within_s)
        await self._pause()
        # pymodbus uses this one setting as time-out of connections and replies alike.
        self.client.ctx.comm_params.timeout_connect = within_s
        self._asking = self._failed = True
        return await send()

    def awaited_s(self, unit: int) -> float:
        """Return for how long a unit's reply, or its turn, has been awaited, s; 0 for none."""
        now = asyncio.get_running_loop().time()
        return now - self._asked.get(unit, now)

    async def _take_turn(self, unit: int) -> None:
        """Wait for a unit's turn.

        A unit that did not answer waits for another time-out, in which the other units on the line
        take their turns: a dead device must not keep them from getting set-points. By then a late
        reply has come, which on a serial line could be taken for that of the next request.
        """
        while True:
            late = self._late.get(unit)
            if late:
                await late.wait()
                if self._late.get(unit) is late:
                    del self._late[unit]
            await self._turn.acquire()
            if unit not in self._late:
                return
            self._turn.release()

    def _note_reply(self, unit: int) -> None:
        """Note that a unit has replied, in time or not."""
        self._quiet_since = asyncio.get_running_loop().time()
        if unit in self._late:
            self._late[unit].came.set()

    @property
    def label(self) -> str:
        """Its name in errors; that of its first device where it has none."""
        return f"line {self._name} ({self.place})" if self._name else self.devices[0]

    async def _pause(self) -> None:
        """Wait for the pause that separates two frames on the line."""
        if self.settings.quiet_s:
            loop = asyncio.get_running_loop()
            await asyncio.sleep(max(0.0, self._quiet_since + self.settings.quiet_s - loop.time()))

    def _note_why_it_ends(self) -> None:
        """Keep the reason why a connection ends, which pymodbus does not hand on."""
        hand_on = self.client.ctx.callback_disconnected

        def note(error: Exception | None) -> None:
            self._ended_by = error
            hand_on(error)

        # pymodbus has no hook for it, so its own method is replaced.
        self.client.ctx.callback_disconnected = note  # type: ignore[assignment, method-assign]

    def _note_connection(self, connected: bool) -> None:
        """End the request that is under way when the connection ends: no reply will come."""
        if not connected and not self._asking and self._answers == 1 and self._closes is None:
            self._closes = True
        answer = self.client.ctx.response_future
        if self._asking and not connected and not answer.done():
            answer.set_exception(ConnectionException("lost"))

    def _loss(self) -> str:
        """Return in words how the connection was lost, and for which devices."""
        others = f", and with it {', '.join(self.devices)}" if self._name else ""
        # With TLS 1.3 a client is refused only after its connection seems complete.
        if isinstance(self.settings, TlsLine) and not self.has_answered:
            return (
                f"the other end closed the line before its first answer{others}; it does not trust"
                " the certificate and key in the rig file, or has stopped"
            )
        if isinstance(self.settings, RtuLine):
            return f"the line is lost{others}; check cable and power"
        if self.has_answered:
            error = self._ended_by
            # A reset comes from the other end, too, which no longer knows the connection.
            if error is None or isinstance(error, ConnectionError | ssl.SSLError):
                return (
                    f"the line is lost{others}: the device closed the connection; end other"
                    " programs that use it, or see whether it restarted or limits idle time"
                )
            return f"the line is lost{others} ({error}); check cable and power"
        came = self.traffic.came
        after = f"after {len(came)} bytes ({as_hex(came)})" if came else "without an answer"
        return (
            f"the other end closed the line {after}{others}; check transport (TCP or RTU frames),"
            " port, and that no other program uses it"
        )

    @property
    def closes(self) -> bool:
        """Whether the other end closes a connection after one answer."""
        return bool(self._closes)

    @property
    def peculiarities(self) -> list[str]:
        """What the line does that others do not, in words; it is served all the same."""
        notes = []
        if self._closes:
            notes.append(
                f"{self.label}: closes its connection after each answer; each request opens a new"
                " one, which takes time"
            )
        if self._reopened and self.has_answered:
            times = "once" if self._reopened == 1 else f"{self._reopened} times"
            notes.append(f"{self.label}: its connection ended {times}, and was opened again")
        if self.takes_one_client:
            notes.append(f"{self.label}: serves one client; all devices there share a connection")
        if self.traffic.echoes:
            notes.append(f"{self.label}: the adapter sends back each request; that is passed over")
        return notes

    async def _refusal(self) -> str:
        """Return why there is no connection, which pymodbus only logs."""
        try:
            if isinstance(self.settings, NetworkLine):
                await asyncio.get_running_loop().getaddrinfo(self.settings.host, self.settings.port)
            if isinstance(self.settings, RtuLine):
                serial.Serial(self.place, exclusive=True).close()
            elif isinstance(self.settings, TlsLine):
                opening = asyncio.open_connection(
                    self.settings.host, self.settings.port, ssl=self._tls
                )
                _, writer = await asyncio.wait_for(opening, self._timeout_s)
                writer.close()
        except OSError as error:
            return explain(error)
        return "refuses the connection; check that the rig is on, and host and port in the rig file"


def lines_of(rig: RigSettings | RecordingRig) -> Callable[[DeviceSettings], Line]:
    """Return a function from a device's settings to its line, one for all devices that share it."""
    timeout_s = rig.safety.connect_s
    shared = {name: Line(settings, timeout_s, name) for name, settings in rig.line.items()}
    return lambda device: (
        shared[device.line] if device.line is not None else Line(rig.line_of(device), timeout_s)
    )
