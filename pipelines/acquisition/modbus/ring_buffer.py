"""A drive's own record of its samples: a ring of registers or a queue (FC24).

Samples that were overwritten before they could be read are gaps in the sequence numbers. No record
is mistaken for another: each has its number, and the newest number is read again after the records,
which shows how many of them the drive may have overwritten meanwhile.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from math import ceil

from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.wraparound import unwrap
from pipelines.modbus.register_block import Block
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.ring import RingSettings

FEWEST_READS = 4
"""Reads that a drain may always take."""

Record = Mapping[str, float]
NoteNewest = Callable[[float, float | None], int]
"""From a counter's value, and the time of the request (s) for the newest sample, to its number."""


def _most_reads(settings: RingSettings, samples_per_cycle: int) -> int:
    """Return the most reads of one drain; the rest waits for the next one, as set-points cannot."""
    # Twice the reads for the samples of a cycle, so that a backlog is worked off.
    return max(FEWEST_READS, ceil(2 * samples_per_cycle / settings.records_per_read))


class Ring:
    """The ring of one drive, read by FC03."""

    def __init__(
        self,
        device: Device,
        settings: RingSettings,
        note_newest: NoteNewest,
        samples_per_cycle: int = 1,
    ) -> None:
        # The rig file is checked: a ring has all three.
        assert settings.newest and settings.address is not None and settings.capacity
        self._device = device
        self._note_newest = note_newest
        self._newest = Block({"newest": settings.newest})
        self._record = Block(registers_of(settings.record))
        self._modulus = int(self._record.modulus("sequence"))
        self._function = settings.function
        self._address, self._capacity = settings.address, settings.capacity
        self._words = settings.words
        self.block = settings.records_per_read
        self._most = _most_reads(settings, samples_per_cycle) * self.block
        """Most records of one drain."""
        self._next: int | None = None
        self._read_again: int | None = None
        """Number of the last record that is or was read a second time."""

    async def forget(self) -> bool:
        """Skip all records so far; return True, since none is left."""
        self._next = self._read_again = None
        return True

    async def drain(self, newest: int) -> list[tuple[int, Record]]:
        """Return new records.

        The first drain returns none: records begin after it.

        Parameters
        ----------
        newest : int
            Number of the drive's newest sample.

        Returns
        -------
        list of tuples
            Sequence number and record, oldest first.

        Raises
        ------
        DeviceError
            The drive did not answer, or refused.
        """
        # Older records are overwritten already.
        first = newest + 1 if self._next is None else max(self._next, newest + 1 - self._capacity)
        # The rest waits: set-points of this drive must not.
        newest = min(newest, first + self._most - 1)
        if first > newest:
            self._next = first
            return []
        read: list[tuple[int, Sequence[int]]] = []
        while first <= newest:
            # A read ends at the ring's last register: the next record is at its first one.
            count = min(newest + 1 - first, self.block, self._capacity - first % self._capacity)
            place = self._address + first % self._capacity * self._words
            words = await self._device.read(
                place, count * self._words, function=self._function, in_motion=True
            )
            read += [
                (first + k, words[k * self._words : (k + 1) * self._words]) for k in range(count)
            ]
            first += count
        sent = time.perf_counter()
        words = await self._device.read(
            self._newest.address, self._newest.count, function=self._function, in_motion=True
        )
        value = self._newest.decode(words)["newest"]
        newest_now = int(unwrap(value, newest, self._modulus))
        # So far from the expected number, all records are overwritten, or the reply is damaged.
        if abs(newest_now - newest) > self._capacity:
            newest_now = newest + self._capacity
        else:
            self._note_newest(value, sent)
        # The drive may have been writing the record after the newest one while these were read.
        overwritten = newest_now + 1 - self._capacity
        self._next = newest + 1  # after the last reply: a drain without it is repeated
        return self._valid([(number, words) for number, words in read if number > overwritten])

    def _valid(self, read: Sequence[tuple[int, Sequence[int]]]) -> list[tuple[int, Record]]:
        """Return the records that hold the expected numbers.

        A drive may count a record before it is completely written, so one with another number is
        read a second time, with those after it; then it is left out.
        """
        records: list[tuple[int, Record]] = []
        for number, words in read:
            record = self._record.decode(
                words[self._record.address : self._record.address + self._record.count]
            )
            if record["sequence"] == number % self._modulus:
                records.append((number, record))
            elif self._read_again is None or number > self._read_again:
                self._read_again = self._next = number
                break
        return records


class Queue:
    """The queue of one drive, read by FC24, which removes the records that it reads."""

    def __init__(self, device: Device, settings: RingSettings, samples_per_cycle: int = 1) -> None:
        assert settings.fifo is not None  # the rig file is checked: a queue has an address
        self._device = device
        self._address, self._words = settings.fifo, settings.words
        self._record = Block(registers_of(settings.record))
        self._modulus = self._record.modulus("sequence")
        self.block = settings.records_per_read
        self._reads = _most_reads(settings, samples_per_cycle)
        self._began: int | None = None
        self._fetched: list[tuple[int, Record]] = []
        """Records that were removed from the queue, but not returned by a drain yet."""

    async def forget(self) -> bool:
        """Discard queued records, at most one drain's; return whether none is left."""
        self._began, self._fetched = None, []
        for _ in range(self._reads):
            if len(await self._read()) < self.block:
                return True
        return False

    async def drain(self, newest: int) -> list[tuple[int, Record]]:
        """Return new records.

        Records from before the first drain are discarded.

        Parameters
        ----------
        newest : int
            Number of the drive's newest sample.

        Returns
        -------
        list of tuples
            Sequence number and record, oldest first.

        Raises
        ------
        DeviceError
            The drive did not answer, or refused.
        """
        if self._began is None:
            self._began = newest
        for _ in range(self._reads):
            read = await self._read()
            # Near the newest sample: a record's own number wraps around.
            numbers = [int(unwrap(record["sequence"], newest, self._modulus)) for record in read]
            self._fetched += [
                (number, record)
                for number, record in zip(numbers, read, strict=True)
                if number > self._began
            ]
            # A read that is not full has emptied the queue.
            if len(read) < self.block:
                break
        records, self._fetched = self._fetched, []
        return records

    async def _read(self) -> list[Record]:
        """Read, and so remove, the oldest records, as many as one read brings."""
        words = await self._device.read_fifo(self._address, self._words)
        places = range(self._record.address, len(words), self._words)
        return [self._record.decode(words[place : place + self._record.count]) for place in places]
