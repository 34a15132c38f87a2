"""A virtual drive's own record of its latest samples: a ring for FC03, or a queue for FC24."""

from collections import deque
from collections.abc import Callable, Mapping

from pymodbus.constants import ExcCodes
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.pdu.file_message import ReadFifoQueueRequest, ReadFifoQueueResponse

from pipelines.modbus.register_block import Block
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.ring import MOST_QUEUED, RingSettings

QUEUE_RECORDS = 4096
"""Capacity of a queue; the oldest record is overwritten."""


class Ring:
    """The latest samples of one drive."""

    def __init__(self, settings: RingSettings) -> None:
        self._block = Block(registers_of(settings.record))
        self._words = settings.words
        self.address, self.capacity = settings.address or 0, settings.capacity or 0
        self.newest = Block({"newest": settings.newest}) if settings.newest else None
        self.fifo = settings.fifo
        self.held = [0] * (self.capacity * self._words)
        """The registers from ``address`` on."""
        self.last = 0
        """Sequence number of the newest record."""
        self._queue: deque[list[int]] = deque(maxlen=QUEUE_RECORDS)

    @property
    def spans(self) -> tuple[range, ...]:
        """Its addresses; a queue has none."""
        if self.newest is None:
            return ()
        newest = range(self.newest.address, self.newest.address + self.newest.count)
        return newest, range(self.address, self.address + len(self.held))

    def append(self, sequence: int, values: Mapping[str, float]) -> None:
        """Add a sample in place of the oldest one."""
        words = [0] * self._words
        words[self._block.address : self._block.address + self._block.count] = self._block.encode(
            values
        )
        if self.fifo is not None:
            self._queue.append(words)
            return
        # Record n has its place in the ring by n modulo the capacity, as clients expect.
        place = sequence % self.capacity * self._words
        self.held[place : place + self._words] = words
        self.last = sequence

    def show(self, registers: list[int], first: int, address: int, count: int) -> None:
        """Write the requested part of the ring into a device's registers.

        Parameters
        ----------
        registers : list of int
            Changed in place.
        first : int
            Address of the first of them.
        address, count : int
            First requested register, and number of registers.
        """
        # Only what was requested: a ring may have thousands of registers, and is read often.
        low, high = max(address, self.address), min(address + count, self.address + len(self.held))
        if low < high:
            registers[low - first : high - first] = self.held[
                low - self.address : high - self.address
            ]
        if self.newest:
            start = self.newest.address - first
            words = self.newest.encode({"newest": self.last % self.newest.modulus("newest")})
            registers[start : start + self.newest.count] = words

    def take(self) -> list[int]:
        """Remove and return the words of as many whole records as one FC24 reply can hold."""
        records = min(len(self._queue), MOST_QUEUED // self._words)
        return [word for _ in range(records) for word in self._queue.popleft()]


def fifo_request(queues: Mapping[int, Callable[[int], list[int] | None]]) -> type[ModbusPDU]:
    """Return an FC24 request that is answered from ``queues``, since pymodbus answers constants.

    Parameters
    ----------
    queues : mapping
        For each unit id, a function from a queue's address to its words; None for no queue.
    """

    class ReadFifo(ReadFifoQueueRequest):
        async def datastore_update(self, context: object, device_id: int) -> ModbusPDU:
            words = queues[device_id](self.address) if device_id in queues else None
            if words is None:
                return ExceptionResponse(self.function_code, ExcCodes.ILLEGAL_ADDRESS)
            return ReadFifoQueueResponse(words, device_id, self.transaction_id)

    return ReadFifo
