"""Strict checks of replies: only a complete, well-formed frame that answers the request counts.

pymodbus is lenient: it accepts transaction id 0 for any, a reply to another function, and a byte
count that does not fit the frame. A frame that it cannot decode raises within asyncio, where no
caller can catch the error. Wrong numbers would move a leg, so every frame is checked here.
"""

from collections.abc import Callable

from pymodbus.client.base import ModbusBaseClient
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.file_message import ReadFifoQueueResponse

from pipelines.acquisition.modbus.framing import RtuFramer, TcpFramer, Traffic
from pipelines.modbus.functions import (
    READ_FIFO,
    READ_HOLDING,
    READ_INPUT,
    READ_WRITE,
    WRITE_MULTIPLE,
    WRITE_SINGLE,
)

ERROR = 0x80
ASKED_FOR = (READ_HOLDING, READ_INPUT, WRITE_SINGLE, WRITE_MULTIPLE, READ_WRITE, READ_FIFO)


class InvalidReply(ModbusPDU):
    """A frame that does not answer the request, with the reason."""

    def __init__(self, reason: str) -> None:
        super().__init__()
        self.reason = reason


class FifoReply(ReadFifoQueueResponse):
    """A reply to FC24; pymodbus 3.16 computes two bytes too few for its frame on a serial line."""

    @classmethod
    def calculateRtuFrameSize(cls, data: bytes) -> int:
        """Return the length of a frame in bytes: unit, function, two counts, content and CRC."""
        return 6 + int.from_bytes(data[2:4], "big")


class ReplyDecoder(DecodePDU):
    """Decodes the content of a reply's frame; never raises."""

    def __init__(self) -> None:
        super().__init__(False)

    def lookupPduClass(self, data: bytes) -> type[ModbusPDU] | None:
        """Return the class of a serial line's frame; None for functions that exoid never uses."""
        if data[1] == READ_FIFO:
            return FifoReply
        return super().lookupPduClass(data) if data[1] & ERROR or data[1] in ASKED_FOR else None

    def decode(self, frame: bytes) -> ModbusPDU:
        """Return the reply, or an InvalidReply."""
        function = frame[0]
        if function > ERROR:
            # The framer has removed unit and CRC. Function and exception code remain.
            whole = len(frame) == 2
        elif function in ASKED_FOR:
            whole = _is_whole(function, frame)
        else:
            return InvalidReply(f"function {function}, which was not asked for")
        if not whole:
            return InvalidReply(f"{len(frame)} bytes that do not fit function {function}")
        # Not by pymodbus's own method: that formats every reply for its log, even if it is off.
        reply = (
            ExceptionResponse(function & ~ERROR)
            if function > ERROR
            else self.pdu_table[function][self.pdu_inx]()
        )
        reply.decode(frame[1:])
        return reply


def _is_whole(function: int, frame: bytes) -> bool:
    """Return whether a reply has the length of its function and counts."""
    if function in (WRITE_SINGLE, WRITE_MULTIPLE):
        # Function, address, and value or count.
        return len(frame) == 5
    if function == READ_FIFO:
        size, count = int.from_bytes(frame[1:3], "big"), int.from_bytes(frame[3:5], "big")
        return len(frame) == 3 + size and size == 2 + 2 * count
    return len(frame) > 1 and frame[1] % 2 == 0 and len(frame) == 2 + frame[1]


class ReplyCheck:
    """Compares each reply of a connection with the request before it."""

    def __init__(self, note_reply: Callable[[int], None]) -> None:
        self._asked = ModbusPDU()
        self._note_reply = note_reply

    def __call__(self, sending: bool, pdu: ModbusPDU) -> ModbusPDU:
        """Remember a request; return a reply, or an InvalidReply in its place."""
        if sending:
            self._asked = pdu
            return pdu
        self._note_reply(pdu.dev_id)
        reason = None if isinstance(pdu, InvalidReply) else self._mismatch(pdu)
        if reason is None:
            return pdu
        invalid = InvalidReply(reason)
        invalid.dev_id, invalid.transaction_id = pdu.dev_id, pdu.transaction_id
        return invalid

    def _mismatch(self, reply: ModbusPDU) -> str | None:
        asked = self._asked
        if reply.transaction_id != asked.transaction_id:
            return f"transaction {reply.transaction_id}, expected {asked.transaction_id}"
        if reply.function_code & ~ERROR != asked.function_code:
            return f"function {reply.function_code}, expected {asked.function_code}"
        if isinstance(reply, ExceptionResponse):
            return None
        if reply.function_code == WRITE_SINGLE:
            return self._other_write(reply)
        if reply.function_code != WRITE_MULTIPLE:
            return None
        if (reply.address, reply.count) != (asked.address, asked.count):
            return (
                f"{reply.count} registers written at {reply.address}, expected {asked.count} at"
                f" {asked.address}"
            )
        return None

    def _other_write(self, reply: ModbusPDU) -> str | None:
        asked = self._asked
        written, expected = (reply.address, reply.registers[0]), (asked.address, asked.registers[0])
        if written == expected:
            return None
        return (
            f"0x{written[1]:04X} written at {written[0]}, expected 0x{expected[1]:04X} at"
            f" {expected[0]}"
        )


def check_replies(
    client: ModbusBaseClient, in_rtu: bool, traffic: Traffic, note_reply: Callable[[int], None]
) -> None:
    """Let a client return only checked replies, and an InvalidReply for any other frame.

    ``note_reply`` is called with the unit of every frame that comes, awaited or not.
    """
    # pymodbus takes each TLS record for one whole frame, which TLS does not guarantee; so TLS has
    # the frames of TCP.
    client.ctx.framer = (RtuFramer if in_rtu else TcpFramer)(ReplyDecoder(), traffic)
    client.ctx.trace_pdu = ReplyCheck(note_reply)
