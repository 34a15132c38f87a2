"""A Modbus device: its requests, and every failure in one sentence."""

from collections.abc import Awaitable, Callable, Iterable, Sequence
from contextlib import AbstractAsyncContextManager
from typing import Any, NamedTuple

from pymodbus.client.base import ModbusBaseClient
from pymodbus.constants import ExcCodes
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ModbusPDU

from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.modbus.reply import InvalidReply
from pipelines.acquisition.modbus.unexpected import described
from pipelines.errors import DeviceError, Refused, Unanswered
from pipelines.modbus.functions import (
    READ_HOLDING,
    READ_INPUT,
    READ_WRITE,
    WRITE_MULTIPLE,
    WRITE_SINGLE,
)
from pipelines.modbus.register_block import Block
from pipelines.settings.rig.block import ReadBlock, registers_of
from pipelines.settings.rig.recording_only import WaitSettings
from pipelines.settings.rig.register_map import Identity
from pipelines.settings.rig.safety import SafetySettings

Waits = SafetySettings | WaitSettings
"""Settings of a rig that say how long answers are awaited."""
MEANING: dict[int, str] = {
    ExcCodes.ILLEGAL_FUNCTION: "it does not know function {function}",
    ExcCodes.ILLEGAL_ADDRESS: "it has no such register",
    ExcCodes.ILLEGAL_VALUE: "it does not take this value",
    ExcCodes.DEVICE_FAILURE: "it failed",
    ExcCodes.ACKNOWLEDGE: "it takes longer to answer",
    ExcCodes.DEVICE_BUSY: "it is busy (server device busy)",
    ExcCodes.NEGATIVE_ACKNOWLEDGE: "it cannot do that now",
    ExcCodes.MEMORY_PARITY_ERROR: "its memory is damaged",
    ExcCodes.GATEWAY_PATH_UNAVIABLE: "the gateway has no path to it",
    ExcCodes.GATEWAY_NO_RESPONSE: "the gateway got no answer from it",
}

INSTEAD = {
    READ_HOLDING: "set function = 4 in its block, if these are input registers",
    READ_INPUT: "set function = 3 in its block, if these are holding registers",
    WRITE_SINGLE: "set write.function = 16 in its map",
    WRITE_MULTIPLE: "set write.function = 6 in its map, which needs a set-point of one register",
    READ_WRITE: "set write.function = 16 in its map",
}
"""What to do where a device does not know a function."""
FOR_NOW = (ExcCodes.ACKNOWLEDGE, ExcCodes.DEVICE_BUSY)
"""Exceptions after which the same request may be answered later."""
_GATEWAY = "check the cable behind the gateway, and the unit id in the rig file"
REMEDY: dict[int, str] = {
    ExcCodes.DEVICE_FAILURE: "see the device's manual and its own display",
    ExcCodes.DEVICE_BUSY: (
        "stop other programs that use it, wait until it is ready, or lower acquire.sample_rate_hz"
    ),
    ExcCodes.GATEWAY_PATH_UNAVIABLE: _GATEWAY,
    ExcCodes.GATEWAY_NO_RESPONSE: _GATEWAY,
}


class TimeOut(NamedTuple):
    """How long a reply is awaited, and the key in a rig file's ``safety`` that sets it."""

    seconds: float
    setting: str


class Device:
    """One device on a line, which takes one request at a time from all its devices."""

    def __init__(self, name: str, unit: int, line: Line, safety: Waits) -> None:
        """Join a line; a rig's safety settings give the time-outs."""
        self.name, self._unit = name, unit
        self.move(line)
        self._at_rest = TimeOut(safety.connect_s, "connect_s")
        self._in_motion = TimeOut(safety.longest_reply_s, "reply_s or watchdog_s")
        self._write = TimeOut(safety.watchdog_s, "watchdog_s")

    def move(self, line: Line) -> None:
        """Join a line, in place of the one before."""
        self.label = line.join(self.name, self._unit)
        self.line = line

    async def read_anything(self, identity: Sequence[Identity], block: ReadBlock) -> None:
        """Read one register, to see whether the device answers.

        Raises
        ------
        DeviceError
            No answer came in time, or an answer that refuses.
        """
        address, function = greeting(identity, block)
        await self.read(address, 1, function=function)

    @property
    def awaited_s(self) -> float:
        """For how long its answer has been awaited, s; 0 where none is awaited."""
        return self.line.awaited_s(self._unit)

    def turn(self) -> AbstractAsyncContextManager[None]:
        """Wait for the device's turn on the line, and keep it for all requests of the block."""
        return self.line.turn(self._unit)

    async def check_identity(self, identity: Iterable[Identity], function: int) -> None:
        """Refuse a device that is not the one that the rig file describes.

        Parameters
        ----------
        identity : iterable of Identity
            Its registers.
        function : int
            Function that reads those which name none.

        Raises
        ------
        DeviceError
            Names the identity register, its value and the expected one.
        """
        for entry in identity:
            (value,) = await self.read(entry.address, 1, function=entry.function or function)
            if value != entry.value:
                raise DeviceError(
                    f"{self.label}: identity register {entry.address} holds 0x{value:04X}, expected"
                    f" 0x{entry.value:04X}: it is another device; check cabling and unit id"
                )

    async def read(
        self, address: int, count: int, *, function: int = READ_HOLDING, in_motion: bool = False
    ) -> list[int]:
        """Read words in one request.

        Parameters
        ----------
        address, count : int
            First register, and number of registers.
        function : int, optional
            3 for holding registers, 4 for input registers.
        in_motion : bool, optional
            Whether to use the short time-out of a moving leg.

        Returns
        -------
        list of int
            The words.

        Raises
        ------
        DeviceError
            No answer came in time, or an answer that refuses.
        """
        action = f"reading {_range(address, count)}"
        time_out = self._in_motion if in_motion else self._at_rest
        request = read_request(self.line.client, function)
        return await self._ask(action, count, time_out, request, address=address, count=count)

    async def read_fifo(self, address: int, words: int) -> list[int]:
        """Read the words of a queue by FC24, whole records of ``words`` each.

        Raises
        ------
        DeviceError
            The answer is not made of whole records.
        """
        action = f"reading the queue at register {address}"
        response = await self._request(
            action, self._in_motion, self.line.client.read_fifo_queue, address=address
        )
        registers = list(getattr(response, "values", []))
        if len(registers) % words:
            raise DeviceError(
                f"{self.label}: answered {action} with {len(registers)} registers, expected a"
                f" multiple of {words}; compare ring.words in the rig file with the device's manual"
            )
        return registers

    async def write(
        self,
        block: Block,
        words: Sequence[int],
        *,
        function: int = WRITE_MULTIPLE,
        in_motion: bool = False,
    ) -> None:
        """Write a block in one request.

        Parameters
        ----------
        block : Block
            Registers to write.
        words : sequence of int
            One for each register.
        function : int, optional
            16, or 6 for a single register.
        in_motion : bool, optional
            Whether to use the short time-out of a moving leg.

        Raises
        ------
        DeviceError
            No answer came in time, or an answer that refuses.
        """
        action = f"writing {_range(block.address, block.count)}"
        time_out = self._in_motion if in_motion else self._write
        client, address = self.line.client, block.address
        if function == WRITE_SINGLE:
            (value,) = words
            await self._ask(
                action, None, time_out, client.write_register, address=address, value=value
            )
            return
        request = client.write_registers
        await self._ask(action, None, time_out, request, address=address, values=list(words))

    async def exchange(self, write: Block, words: Sequence[int], read: Block) -> list[int]:
        """Write one block and read another in one FC23 exchange.

        Parameters
        ----------
        write : Block
            Registers to write.
        words : sequence of int
            One for each register to write.
        read : Block
            Registers to read.

        Returns
        -------
        list of int
            The words read.

        Raises
        ------
        DeviceError
            No answer came in time, or an answer that refuses.
        """
        action = (
            f"an exchange (writing {_range(write.address, write.count)}, reading"
            f" {_range(read.address, read.count).removeprefix('registers ')})"
        )
        return await self._ask(
            action,
            read.count,
            self._in_motion,
            self.line.client.readwrite_registers,
            read_address=read.address,
            read_count=read.count,
            write_address=write.address,
            values=list(words),
        )

    async def send(self, request: ModbusPDU) -> None:
        """Send a request that has no method of its own.

        Raises
        ------
        DeviceError
            No answer came in time, or an answer that refuses.
        """

        def execute(device_id: int) -> Awaitable[ModbusPDU]:
            request.dev_id = device_id
            return self.line.client.execute(False, request)

        await self._request(f"function {request.function_code}", self._at_rest, execute)

    async def _ask(
        self,
        action: str,
        words: int | None,
        time_out: TimeOut,
        request: Callable[..., Awaitable[ModbusPDU]],
        **arguments: Any,
    ) -> list[int]:
        """Send a request and return the words of its answer, ``words`` of them if given."""
        response = await self._request(action, time_out, request, **arguments)
        if words is not None and len(response.registers) != words:
            raise DeviceError(
                f"{self.label}: answered {action} with {len(response.registers)} registers,"
                f" expected {words}; compare its register map with the manual"
            )
        return list(response.registers)

    async def _request(
        self,
        action: str,
        time_out: TimeOut,
        request: Callable[..., Awaitable[ModbusPDU]],
        **arguments: Any,
    ) -> ModbusPDU:
        """Send a request and return its answer; raise DeviceError for none or a refusal."""
        try:
            response = await self.line.ask(self._unit, time_out.seconds, request, **arguments)
        except (ModbusException, OSError) as error:
            # On an open line the next request may be answered; a lost line ends the run.
            kind = Unanswered if self.line.client.connected else DeviceError
            came = described(self.line.traffic.asked, self.line.traffic.came) or (
                f"did not answer {action} within {time_out.seconds:.3g} s; check cable and power,"
                f" or raise safety.{time_out.setting} in the rig file"
            )
            raise kind(f"{self.label}: {came}") from error
        if isinstance(response, InvalidReply):
            raise DeviceError(
                f"{self.label}: answered {action} with {response.reason}; check that it speaks"
                " Modbus, and the line"
            )
        # pymodbus does not raise an exception for an exception reply.
        if response.isError():
            raise self._refusal(action, response)
        return response

    def _refusal(self, action: str, response: ModbusPDU) -> Refused:
        """Return the error of an exception reply."""
        code = int(getattr(response, "exception_code", 0))
        function = self.line.traffic.asked.function
        meaning = f": {MEANING[code].format(function=function)}" if code in MEANING else ""
        remedy = REMEDY.get(
            code, "compare the register map in the rig file with the device's manual"
        )
        if code == ExcCodes.ILLEGAL_FUNCTION:
            remedy = INSTEAD.get(function, remedy)
        refusal = Refused(
            f"{self.label}: answered {action} with Modbus exception {code}{meaning}; {remedy}"
        )
        refusal.code = code
        return refusal


def greeting(identity: Sequence[Identity], block: ReadBlock) -> tuple[int, int]:
    """Return address and function of the register that shows whether a device answers."""
    if identity:
        return identity[0].address, identity[0].function or block.function
    return min(one.address for one in registers_of(block).values()), block.function


def read_request(client: ModbusBaseClient, function: int) -> Callable[..., Awaitable[ModbusPDU]]:
    """Return the client's request of a function that reads registers."""
    return client.read_input_registers if function == READ_INPUT else client.read_holding_registers


def _range(address: int, count: int) -> str:
    """Return some registers in words."""
    return f"register {address}" if count == 1 else f"registers {address} to {address + count - 1}"
