"""One device under check, whose answers are kept as raw words."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.machine.force_sensor import Sensor
from pipelines.acquisition.machine.read_only import ReadOnlyPart
from pipelines.acquisition.modbus.blocks import BlockReader
from pipelines.acquisition.modbus.wraparound import Unwrapper
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import Register
from pipelines.settings.rig.devices import SensorSettings

Answer = tuple[float, float, list[int]]
"""When it was asked and answered (host's clock, s), and the words."""


@dataclass(frozen=True)
class Series:
    """Answers of one device, with the instants of request and answer (host's clock)."""

    block: Block
    asked: NDArray
    """(n,) s."""
    answered: NDArray
    """(n,) s."""
    words: NDArray
    """(n, registers of the block)."""

    @classmethod
    async def read(cls, reader: BlockReader, seconds: float) -> Self:
        """Read a block again and again.

        Parameters
        ----------
        reader : BlockReader
            Of the block.
        seconds : float
            For how long.

        Raises
        ------
        DeviceError
            The device did not answer, or refused.
        """
        answers: list[Answer] = []
        until = time.perf_counter() + seconds
        while not answers or time.perf_counter() < until:
            asked = time.perf_counter()
            words = await reader.read()
            answers.append((asked, time.perf_counter(), words))
        return cls.of_answers(reader.block, answers)

    @classmethod
    def of_answers(cls, block: Block, answers: Sequence[Answer]) -> Self:
        """Return answers as a series."""
        asked, answered, words = zip(*answers, strict=True) if answers else ((), (), ())
        shaped = np.array(words, dtype=np.int64).reshape(len(answers), block.count)
        return cls(block, np.array(asked), np.array(answered), shaped)

    def of(
        self,
        name: str,
        register: Register | None = None,
        *,
        bytes_swapped: bool = False,
        counts: bool = False,
    ) -> NDArray:
        """Return a quantity's values.

        Parameters
        ----------
        name : str
            The quantity.
        register : Register, optional
            Another way to decode it.
        bytes_swapped : bool, optional
            Whether to swap the bytes of each word.
        counts : bool, optional
            Whether it is a counter or clock, whose wraparounds are removed.

        Returns
        -------
        (n,) array
            In SI units.
        """
        register = register or self.block.registers[name]
        one = Block({name: register})
        start = one.address - self.block.address
        words = self.words[:, start : start + one.count]
        if bytes_swapped:
            words = (words >> 8) | ((words & 0xFF) << 8)
        values = [one.decode(row)[name] for row in words.tolist()]
        if register.turn:
            values = list(map(Unwrapper(register.turn), values))
        if counts:
            # By the modulus of the register under test: another type wraps around elsewhere.
            values = list(map(Unwrapper(one.modulus(name)), values))
        return np.array(values)

    @property
    def fresh(self) -> NDArray:
        """Indices of the first answer with each new sample, (k,)."""
        if "sequence" not in self.block.names:
            return np.arange(len(self.asked))
        is_new = (np.diff(self.raw("sequence"), axis=0) != 0).any(axis=1)
        return np.flatnonzero(np.r_[True, is_new])

    def raw(self, name: str) -> NDArray:
        """Return the words of a quantity, (n, registers of it)."""
        register = self.block.registers[name]
        start = register.address - self.block.address
        return self.words[:, start : start + register.registers]


class Probe:
    """A drive or sensor of the rig, with its recent answers."""

    def __init__(self, part: Drive | Sensor | ReadOnlyPart, in_lockstep: bool) -> None:
        self.part = part
        self.is_drive = not isinstance(part.settings, SensorSettings)
        self.in_lockstep = in_lockstep
        self.block = part.reader.block
        settings = part.settings
        kind, place = (
            ("sensor", settings.cuff)
            if isinstance(settings, SensorSettings)
            else ("drive", settings.joint)
        )
        self.name = f"{kind} {place}"
        self.place: str = place
        self.map_path = f"map.{kind}.{part.settings.map}"
        self.every = part.settings.every if isinstance(part, Sensor) else 1
        """Cycles of a run from one reading to the next."""
        self.answers_as: int | None = None
        """Unit under which it seems to be, if another than the rig file's."""
        self._answers: list[Answer] = []
        self._last = [0] * self.block.count

    def finding(self, text: str, quantity: str = "") -> Finding:
        """Return a finding about the device."""
        return Finding(self.name, text, quantity)

    def is_due(self, cycle: int) -> bool:
        """Return whether a run reads the device in a cycle."""
        return not isinstance(self.part, Sensor) or self.part.is_due(cycle)

    async def read(self) -> None:
        """Read the block and keep the answer."""
        asked = time.perf_counter()
        self._keep(asked, await self.part.reader.read())

    async def step(self) -> None:
        """Advance a disabled drive in lockstep to its next sample; read any other device."""
        if not (self.in_lockstep and isinstance(self.part, Drive)):
            return await self.read()
        asked = time.perf_counter()
        # In lockstep only an exchange lets time pass, so it carries the word to disable.
        words = await self.part.idle_words(self.part.map.disable, self.last()["angle"])
        self._keep(
            asked,
            await self.part.device.exchange(self.part.write_block, words, self.part.read_block),
        )

    async def count(self) -> None:
        """Read the sample counter alone, as a run does before each sample."""
        counter = self.block.registers["sequence"]
        await self.part.device.read(
            counter.address, counter.registers, function=self.part.reader.function
        )

    def last(self) -> dict[str, float]:
        """Return the last answer's values, SI units."""
        return self.block.decode(self._last)

    def take(self) -> Series:
        """Return the answers since the last call, and forget them.

        Returns
        -------
        Series
            n answers; none where there was none.
        """
        answers, self._answers = self._answers, []
        return Series.of_answers(self.block, answers)

    def _keep(self, asked: float, words: list[int]) -> None:
        self._answers.append((asked, time.perf_counter(), words))
        self._last = words
