"""The frames of a line, with all that comes: strangers' frames are skipped, but remembered."""

from collections.abc import Callable

from pymodbus.framer import FramerRTU, FramerSocket
from pymodbus.framer.base import FramerBase
from pymodbus.pdu import DecodePDU, ModbusPDU

from pipelines.acquisition.modbus.unexpected import SentRequest
from pipelines.modbus.functions import WRITE_SINGLE

Trace = Callable[[bool, bytes], None]
"""Takes whether bytes were sent, and the bytes."""
MOST_KEPT = 1024
"""Bytes of one request's time that are kept, to describe them."""


class Traffic:
    """The request under way on a line, and all bytes that came since."""

    def __init__(self) -> None:
        self.asked = SentRequest(b"", 0, 0, 0, False)
        self.came = b""
        self.echoes: bool | None = None
        """Whether the adapter sends back what it is sent; None until an answer shows it."""
        self.trace: Trace = lambda sent, data: None
        self._pending = 0
        """Bytes that were shown before, but not used up."""

    def ask(self, asked: SentRequest) -> None:
        """Begin with a request."""
        self.asked, self.came, self._pending = asked, b"", 0
        self.trace(True, asked.frame)

    def receive(self, data: bytes) -> None:
        """Note a buffer of bytes, the first of which may have been noted before."""
        new = data[self._pending :]
        if new:
            self.trace(False, new)
        self.came = (self.came + new)[:MOST_KEPT]
        self._pending = len(data)

    def use(self, count: int) -> None:
        """Note that so many bytes of the buffer are used up."""
        self._pending -= count


class ListeningFramer(FramerBase):
    """What both kinds of frames share."""

    in_rtu: bool

    def __init__(self, decoder: DecodePDU, traffic: Traffic) -> None:
        super().__init__(decoder)
        self.traffic = traffic

    def buildFrame(self, message: ModbusPDU) -> bytes:
        """Return a request's frame, and remember it."""
        frame = super().buildFrame(message)
        transaction = 0 if self.in_rtu else message.transaction_id
        self.traffic.ask(
            SentRequest(frame, message.dev_id, transaction, message.function_code, self.in_rtu)
        )
        return frame

    def handleFrame(
        self, data: bytes, exp_devid: int, exp_tid: int
    ) -> tuple[int, ModbusPDU | None]:
        """Return the bytes used, and the answer of the unit that was asked, if it is among them."""
        self.traffic.receive(data)
        used, reply = self._find(data, exp_devid, exp_tid)
        self.traffic.use(used)
        return used, reply

    def _find(self, data: bytes, unit: int, transaction: int) -> tuple[int, ModbusPDU | None]:
        used = self._echo(data)
        while used < len(data):
            length, came_from, number, content = self.decode(data[used:])
            used += length
            if not length or not content:
                break
            # pymodbus takes any unit for 0, which is a unit like others on Modbus TCP.
            if came_from != unit or (number and transaction and number != transaction):
                continue
            reply = self.decoder.decode(content)
            assert reply is not None  # a ReplyDecoder returns an InvalidReply instead
            reply.dev_id, reply.transaction_id = came_from, number
            self._note_answer()
            return used, reply
        return used, None

    def _note_answer(self) -> None:
        """Note that an answer came."""

    def _echo(self, data: bytes) -> int:
        """Return how many bytes are an echo of the request."""
        return 0


class TcpFramer(ListeningFramer, FramerSocket):
    """Modbus TCP frames."""

    in_rtu = False


class RtuFramer(ListeningFramer, FramerRTU):
    """RTU frames; the local echo of an adapter is passed over."""

    in_rtu = True

    _passed = False
    """Whether the echo of the request under way was passed over."""

    def buildFrame(self, message: ModbusPDU) -> bytes:
        """Return a request's frame; its echo is awaited again."""
        self._passed = False
        return super().buildFrame(message)

    @property
    def _awaits_echo(self) -> bool:
        if self._passed or not self.traffic.asked.frame:
            return False
        # The answer to FC06 equals its request, so it does not show whether the adapter echoes.
        if self.traffic.echoes is None:
            return self.traffic.asked.function != WRITE_SINGLE
        return self.traffic.echoes

    def _echo(self, data: bytes) -> int:
        sent = self.traffic.asked.frame
        if not self._awaits_echo or not data.startswith(sent):
            return 0
        self._passed = self.traffic.echoes = True
        return len(sent)

    def _note_answer(self) -> None:
        if self._awaits_echo:
            self.traffic.echoes = False

    def decode(self, data: bytes) -> tuple[int, int, int, bytes]:
        """Return the length of the first frame, its unit, 0 and its content; 0 to read more."""
        # The beginning of an echo looks like a damaged answer, and pymodbus would discard it.
        if self._awaits_echo and self.traffic.asked.frame.startswith(data):
            return 0, 0, 0, self.EMPTY
        return super().decode(data)
