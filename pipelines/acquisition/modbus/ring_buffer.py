"""A drive's own record of its samples, drained in blocks: a ring of registers (FC03) or a queue
(FC24).

What was overwritten before it could be drained is missing from what a drain returns, and shows as a
gap in the sequence numbers. It is never taken for something else: every record carries its number,
and the newest number is read once more after the records, so that one which the drive may have
overwritten meanwhile is known.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from math import ceil

from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.wraparound import carried
from pipelines.modbus.register_block import Block
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.ring import RingSettings

FEWEST_READS = 4
"""Reads that a drain may take, however few bring what a cycle does."""

Record = Mapping[str, float]
Numbered = Callable[[float, float | None], int]
"""From what a counter's register held to the sample's number, which goes on beyond the register's
width; and, where it was the drive's newest sample, when it was asked for (host's clock, s)."""


def most_reads(settings: RingSettings, samples_per_cycle: int) -> int:
    """Return how many reads one drain may take; what is left waits for the next one, as set-points
    do not.

    Twice what a cycle brings: what had to wait is made up for.
    """
    return max(FEWEST_READS, ceil(2 * samples_per_cycle / settings.records_per_read))


class Ring:
    """The ring of one drive, which FC03 reads."""

    def __init__(
        self, device: Device, settings: RingSettings, numbered: Numbered, samples_per_cycle: int = 1
    ) -> None:
        # A ring has all three.
        assert settings.newest and settings.address is not None and settings.capacity
        self._device = device
        self._numbered = numbered
        self._newest = Block({"newest": settings.newest})
        self._record = Block(registers_of(settings.record))
        self._span = int(self._record.span("sequence"))
        self._address, self._capacity, self._words = (
            settings.address,
            settings.capacity,
            settings.words,
        )
        self.block = settings.records_per_read
        self._most = most_reads(settings, samples_per_cycle) * self.block
        """Records that one drain brings."""
        self._next: int | None = None
        self._doubted: int | None = None

    async def forget(self) -> bool:
        """Begin anew with the records that come from now on; tell whether all others are gone."""
        self._next = self._doubted = None
        return True

    async def drain(self, newest: int) -> list[tuple[int, Record]]:
        """Return records not returned before, each with its sequence number, up to the ``newest``
        known to be there.

        The first drain returns none: it says where to begin.
        """
        first = newest + 1 if self._next is None else max(self._next, newest + 1 - self._capacity)
        newest = min(newest, first + self._most - 1)
        if first > newest:
            self._next = first
            return []
        read: list[tuple[int, Sequence[int]]] = []
        while first <= newest:
            # A read ends at the ring's end, where the numbers go on at its beginning.
            count = min(newest + 1 - first, self.block, self._capacity - first % self._capacity)
            place = self._address + first % self._capacity * self._words
            words = await self._device.read(place, count * self._words, in_motion=True)
            read += [
                (first + k, words[k * self._words : (k + 1) * self._words]) for k in range(count)
            ]
            first += count
        sent = time.perf_counter()
        words = await self._device.read(self._newest.address, self._newest.count, in_motion=True)
        number = self._newest.decode(words)["newest"]
        ends = int(carried(number, newest, self._span))
        # So far from what the exchange told: all of it is overwritten, or the answer damaged.
        # Nothing of it is sure.
        if abs(ends - newest) > self._capacity:
            ends = newest + self._capacity
        else:
            self._numbered(number, sent)
        # The drive may have been writing the record after that one while these were read.
        overwritten = ends + 1 - self._capacity
        self._next = newest + 1  # not before all was answered: what was not is read again
        return self._trusted([(number, words) for number, words in read if number > overwritten])

    def _trusted(self, read: Sequence[tuple[int, Sequence[int]]]) -> list[tuple[int, Record]]:
        """Return the records that hold the numbers they should.

        A drive may count a record before it has written it whole, so one with another number is
        read once more; if that does not help, it is left out.
        """
        records: list[tuple[int, Record]] = []
        for number, words in read:
            record = self._record.decode(
                words[self._record.address : self._record.address + self._record.count]
            )
            if record["sequence"] == number % self._span:
                records.append((number, record))
            elif self._doubted is None or number > self._doubted:
                self._doubted = self._next = number
                break
        return records


class Queue:
    """The queue of one drive, which FC24 reads and which reading empties."""

    def __init__(self, device: Device, settings: RingSettings, samples_per_cycle: int = 1) -> None:
        assert settings.fifo is not None  # a queue has an address
        self._device = device
        self._address, self._words = settings.fifo, settings.words
        self._record = Block(registers_of(settings.record))
        self._span = self._record.span("sequence")
        self.block = settings.records_per_read
        self._reads = most_reads(settings, samples_per_cycle)
        self._began: int | None = None
        self._fetched: list[tuple[int, Record]] = []
        """Records that nobody else has any more, until a drain returns them."""

    async def forget(self) -> bool:
        """Let go what has gathered in it, as far as one drain reaches; tell whether that was
        all."""
        self._began, self._fetched = None, []
        for _ in range(self._reads):
            if len(await self._read()) < self.block:
                return True
        return False

    async def drain(self, newest: int) -> list[tuple[int, Record]]:
        """Return records not returned before, each with its sequence number.

        What had gathered in the queue before the first drain is let go.
        """
        if self._began is None:
            self._began = newest
        for _ in range(self._reads):
            words = await self._read()
            numbered = [
                (int(carried(record["sequence"], newest, self._span)), record) for record in words
            ]
            self._fetched += [
                (number, record) for number, record in numbered if number > self._began
            ]
            if len(words) < self.block:
                break
        records, self._fetched = self._fetched, []
        return records

    async def _read(self) -> list[Record]:
        """Return the oldest records, as many as one read brings, which lets them go."""
        words = await self._device.read_fifo(self._address, self._words)
        places = range(self._record.address, len(words), self._words)
        return [self._record.decode(words[place : place + self._record.count]) for place in places]
