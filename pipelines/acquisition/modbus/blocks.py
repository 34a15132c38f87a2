"""Reading and writing whole blocks, in as many requests as a device needs for them."""

from collections.abc import Sequence

from pipelines.acquisition.modbus.device import Device
from pipelines.errors import Unanswered
from pipelines.modbus.functions import READ_WRITE, WRITE_MULTIPLE, WRITE_SINGLE
from pipelines.modbus.register_block import Block
from pipelines.settings.rig.block import MOST_REGISTERS, ReadBlock, registers_of
from pipelines.settings.rig.register import Register
from pipelines.settings.rig.register_map import DriveWrite, read_requests
from pipelines.settings.rig.requests import requests_of


class BlockReader:
    """Reads a device's block; all of its words are of one sample."""

    def __init__(self, device: Device, settings: ReadBlock) -> None:
        self._device = device
        registers = registers_of(settings)
        self.block, self.function = Block(registers), settings.function
        self.requests = read_requests(settings)
        self._counter: Register | None = registers.get("sequence")

    async def read(self, *, in_motion: bool = False) -> list[int]:
        """Return the words of the block; those that no request brings are 0.

        Parameters
        ----------
        in_motion : bool, optional
            Whether to use the short time-out of a moving leg.

        Raises
        ------
        Unanswered
            The device takes a new sample between the requests, again and again.
        DeviceError
            No answer came in time, or an answer that refuses.
        """
        # Each try begins soon after a new sample, so the second already succeeds on a line that
        # takes less than half a sample; the others are for a busy computer.
        tries = 8
        for _ in range(tries):
            words = await self._parts(in_motion)
            if len(self.requests) == 1 or self._counter is None:
                return words
            counter = self._counter
            begin = counter.address - self.block.address
            again = await self._device.read(
                counter.address, counter.registers, function=self.function, in_motion=in_motion
            )
            # The counter was read with its own part: if it stands, so did all parts in between.
            if again == words[begin : begin + counter.registers]:
                return words
        raise Unanswered(
            f"{self._device.label}: took a new sample while its {len(self.requests)} requests were"
            f" under way, {tries} times; raise most_words, or lower acquire.sample_rate_hz"
        )

    async def _parts(self, in_motion: bool) -> list[int]:
        words = [0] * self.block.count
        for request in self._counter_first():
            begin = request.start - self.block.address
            words[begin : begin + len(request)] = await self._device.read(
                request.start, len(request), function=self.function, in_motion=in_motion
            )
        return words

    def _counter_first(self) -> Sequence[range]:
        """Return the requests, that of the counter first: parts before it would be unguarded."""
        counter = self._counter
        if counter is None:
            return self.requests
        return sorted(self.requests, key=lambda one: counter.address not in one)


class BlockWriter:
    """Writes a drive's block, as a whole or in parts."""

    def __init__(self, device: Device, settings: DriveWrite) -> None:
        self._device = device
        registers = registers_of(settings)
        self._block = Block(registers)
        self._function = WRITE_SINGLE if settings.function == WRITE_SINGLE else WRITE_MULTIPLE
        self.exchanges = settings.function == READ_WRITE
        """Whether a set-point goes out and a sample comes in with one request."""
        most = 1 if self._function == WRITE_SINGLE else MOST_REGISTERS["write"]
        runs = requests_of((r.addresses for r in registers.values()), most, across_gaps=False)
        self._parts = [
            Block({name: r for name, r in registers.items() if r.address in run}) for run in runs
        ]

    async def write(
        self, words: Sequence[int], *, control_first: bool, in_motion: bool = False
    ) -> None:
        """Write the block.

        Parameters
        ----------
        words : sequence of int
            One for each register of the block.
        control_first : bool
            Whether the control word precedes the set-point where both need a request: it does
            where a drive is to let go, and follows where a drive is to follow the set-point.
        in_motion : bool, optional
            Whether to use the short time-out of a moving leg.

        Raises
        ------
        DeviceError
            No answer came in time, or an answer that refuses.
        """
        for part in sorted(self._parts, key=lambda one: ("control" in one.names) != control_first):
            begin = part.address - self._block.address
            part_words = words[begin : begin + part.count]
            await self._device.write(part, part_words, function=self._function, in_motion=in_motion)
