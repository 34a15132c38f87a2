"""What counts as a reply: a whole frame, well formed, that answers what was asked. Everything else
is none.

pymodbus is lenient: it takes transaction id 0 for any, a reply to another function, a byte count
that does not fit the frame; and what it cannot decode it raises within asyncio, where nobody waits
for it. Numbers move a leg here.
"""

from collections.abc import Callable

from pymodbus.client.base import ModbusBaseClient
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.file_message import ReadFifoQueueResponse

ERROR = 0x80
READ_HOLDING, WRITE_MULTIPLE, READ_FIFO, READ_WRITE = 3, 16, 24, 23
ASKED_FOR = (READ_HOLDING, WRITE_MULTIPLE, READ_FIFO, READ_WRITE)


class NoReply(ModbusPDU):
    """A frame that answers nothing, and what is wrong with it."""

    def __init__(self, found: str) -> None:
        super().__init__()
        self.found = found


class FifoReply(ReadFifoQueueResponse):
    """What FC24 brings; pymodbus 3.16 takes its frame on a serial line for two bytes shorter than
    it is."""

    @classmethod
    def calculateRtuFrameSize(cls, data: bytes) -> int:
        """Return how long a frame is that begins like this: unit, function, two counts, what they
        count, CRC."""
        return 6 + int.from_bytes(data[2:4], "big")


class ReplyDecoder(DecodePDU):
    """Decodes what follows the head of a reply's frame; never raises."""

    def __init__(self) -> None:
        super().__init__(False)

    def lookupPduClass(self, data: bytes) -> type[ModbusPDU] | None:
        """Return what a frame on a serial line would be; None for what exoid never asks for."""
        if data[1] == READ_FIFO:
            return FifoReply
        return super().lookupPduClass(data) if data[1] & ERROR or data[1] in ASKED_FOR else None

    def decode(self, frame: bytes) -> ModbusPDU:
        """Return the reply, or what it is instead of one."""
        function = frame[0]
        if function > ERROR:
            whole = len(frame) == 2
        elif function in ASKED_FOR:
            whole = _is_whole(function, frame)
        else:
            return NoReply(f"function {function}, which was not asked for")
        if not whole:
            return NoReply(f"{len(frame)} bytes that do not fit function {function}")
        # Not by pymodbus's own: that writes every reply out for its log, wanted or not.
        reply = (
            ExceptionResponse(function & ~ERROR)
            if function > ERROR
            else self.pdu_table[function][self.pdu_inx]()
        )
        reply.decode(frame[1:])
        return reply


def _is_whole(function: int, frame: bytes) -> bool:
    """Tell whether a reply is as long as its function and its own counts say."""
    if function == WRITE_MULTIPLE:
        return len(frame) == 5
    if function == READ_FIFO:
        size, count = int.from_bytes(frame[1:3], "big"), int.from_bytes(frame[3:5], "big")
        return len(frame) == 3 + size and size == 2 + 2 * count
    return len(frame) > 1 and frame[1] % 2 == 0 and len(frame) == 2 + frame[1]


class Conversation:
    """Requests and replies of one connection, one after the other."""

    def __init__(self, note: Callable[[int], None]) -> None:
        self._asked = ModbusPDU()
        self._note = note

    def __call__(self, sending: bool, pdu: ModbusPDU) -> ModbusPDU:
        """Remember a request; return a reply, or what is wrong with it."""
        if sending:
            self._asked = pdu
            return pdu
        self._note(pdu.dev_id)
        wrong = None if isinstance(pdu, NoReply) else self._wrong(pdu)
        return pdu if wrong is None else _instead(pdu, wrong)

    def _wrong(self, reply: ModbusPDU) -> str | None:
        asked = self._asked
        if reply.transaction_id != asked.transaction_id:
            return f"transaction {reply.transaction_id}, expected {asked.transaction_id}"
        if reply.function_code & ~ERROR != asked.function_code:
            return f"function {reply.function_code}, expected {asked.function_code}"
        if isinstance(reply, ExceptionResponse) or reply.function_code != WRITE_MULTIPLE:
            return None
        if (reply.address, reply.count) != (asked.address, asked.count):
            return (
                f"{reply.count} registers written at {reply.address}, expected {asked.count} at"
                f" {asked.address}"
            )
        return None


def _instead(reply: ModbusPDU, wrong: str) -> NoReply:
    none = NoReply(wrong)
    none.dev_id, none.transaction_id = reply.dev_id, reply.transaction_id
    return none


def check_replies(client: ModbusBaseClient, note: Callable[[int], None]) -> None:
    """Have a client hand out nothing but replies, and a NoReply for what came instead of one.

    ``heard`` is told the unit of each that comes, wanted or not.
    """
    client.ctx.framer.decoder = ReplyDecoder()
    client.ctx.trace_pdu = Conversation(note)
