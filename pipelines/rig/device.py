"""The devices of the virtual rig: registers of drives and force sensors."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np
from pymodbus.constants import ExcCodes
from pymodbus.simulator import DataType, SimData, SimDevice

from pipelines.mechanics.motion import CUFFS
from pipelines.modbus.functions import READ_HOLDING, READ_WRITE, WRITE_MULTIPLE
from pipelines.modbus.register_block import Block
from pipelines.rig.clocks import OwnClock
from pipelines.rig.plant import JOINTS, Samples
from pipelines.rig.ring import Ring
from pipelines.rig.servo import Servo
from pipelines.settings.rig.block import ReadBlock, registers_of
from pipelines.settings.rig.devices import DriveSettings, SensorSettings
from pipelines.settings.rig.register_map import DriveMap, Identity, SensorMap

if TYPE_CHECKING:
    from pipelines.rig.virtual_rig import VirtualRig


class Device(ABC):
    """Registers of one device, filled at each request with the sample that is latched then."""

    ring: Ring | None = None
    """Records of earlier samples, of a drive that keeps them."""

    def __init__(
        self,
        rig: "VirtualRig",
        unit: int,
        identity: Iterable[Identity],
        blocks: Iterable[Block],
        read: ReadBlock,
    ) -> None:
        self.rig = rig
        self.unit = unit
        self.functions: set[int] = {read.function}
        """Function codes that it knows."""
        self._most_words = read.most_words
        self.identity = tuple(identity)
        self.blocks = tuple(blocks)
        self.registers: list[int] = []
        """The device's words from address ``first`` on, shared with the server."""
        self.first = 0
        self.written = False
        """Whether it was written to since the last sample."""

    def as_served(self) -> SimDevice:
        """Return the device for the server."""
        held = {entry.address: entry.value for entry in self.identity}
        for span in self.spans():
            held |= dict.fromkeys(span, 0)
        # One SimData for each stretch of addresses; registers in between do not exist.
        stretches = groupby(enumerate(sorted(held)), lambda numbered: numbered[1] - numbered[0])
        addresses = [[address for _, address in stretch] for _, stretch in stretches]
        data = [
            SimData(a[0], values=[held[i] for i in a], datatype=DataType.REGISTERS)
            for a in addresses
        ]
        return SimDevice(self.unit, simdata=data, action=self._serve)

    def spans(self) -> tuple[range, ...]:
        """Return the addresses of its registers and of its ring, except those of its identity."""
        blocks = tuple(range(block.address, block.address + block.count) for block in self.blocks)
        return blocks + (self.ring.spans if self.ring else ())

    async def _serve(
        self,
        function: int,
        first: int,
        address: int,
        count: int,
        registers: list[int],
        written: list | None,
    ) -> ExcCodes | None:
        self.registers, self.first = registers, first
        if function not in self.functions:
            return ExcCodes.ILLEGAL_FUNCTION
        if written is None and count > self._most_words:
            return ExcCodes.ILLEGAL_VALUE
        if written is not None and not self.takes(address, count):
            return ExcCodes.ILLEGAL_ADDRESS
        self.rig.catch_up()  # with the old set-point, before a write takes effect
        # pymodbus serves FC23 by two calls, a write and then a read. The exchange ends with the
        # read.
        self.written |= written is not None
        if written is None:
            self.show(self.latched())
            if self.ring:
                self.ring.show(self.registers, self.first, address, count)
            # In lockstep this exchange ends a cycle.
            if function == READ_WRITE:
                self.rig.exchanged(self)
        return None

    def takes(self, address: int, count: int) -> bool:
        """Return whether registers may be written; those that are only read may not."""
        return False

    def latched(self) -> Samples:
        """Return the sample that the device has latched."""
        return self.rig.sample

    @abstractmethod
    def show(self, sample: Samples) -> None:
        """Put a sample into the registers."""

    def _put(self, block: Block, values: dict[str, float]) -> None:
        start = block.address - self.first
        self.registers[start : start + block.count] = block.encode(values)


class Drive(Device):
    """A drive: follows its set-point while it is enabled."""

    def __init__(
        self, rig: "VirtualRig", settings: DriveSettings, registers: DriveMap, servo: Servo
    ) -> None:
        self.read = Block(registers_of(registers.read))
        self.write = Block(registers_of(registers.write))
        self.ring = Ring(registers.ring) if registers.ring else None
        blocks = (self.read, self.write)
        super().__init__(rig, settings.unit, registers.identity, blocks, registers.read)
        # Without FC23 it takes set-points by the other function alone.
        self.functions |= {READ_HOLDING, registers.write.function}
        if registers.write.function == READ_WRITE:
            self.functions |= {WRITE_MULTIPLE}
        self.joint = JOINTS.index(settings.joint)
        self.torque_per_ampere = settings.torque_per_ampere
        self.servo = servo
        self._beat: float | None = None
        self.clock: OwnClock | None = None
        self.sample: Samples | None = None
        """Latest sample by its own clock."""

    def takes(self, address: int, count: int) -> bool:
        """Return whether registers may be written; those that are only read may not."""
        return (
            self.write.address <= address
            and address + count <= self.write.address + self.write.count
        )

    def receive(self) -> None:
        """Pass a set-point and control word that were written since the last call to the servo."""
        if not self.written:
            return
        self.written = False
        start = self.write.address - self.first
        values = self.write.decode(self.registers[start : start + self.write.count])
        # With a heartbeat register, only a new count proves that the host is alive.
        beat, self._beat = self._beat, values.get("heartbeat")
        if beat is None or beat != self._beat:
            self.servo.receive(values["reference"], int(values["control"]))

    def record(self, samples: Samples) -> None:
        """Add the plant's newest samples."""
        if self.clock:
            samples = self.clock.sampled(samples)
            if len(samples.sequence):
                self.sample = samples[-1:]
        if self.ring:
            for k, sequence in enumerate(samples.sequence.tolist()):
                self.ring.append(sequence, self._values(samples[k : k + 1]))

    def latched(self) -> Samples:
        """Return the sample that the device has latched."""
        return self.sample or self.rig.sample

    def show(self, sample: Samples) -> None:
        """Put a sample into the registers."""
        self.receive()
        self._put(self.read, self._values(sample))

    def queue(self, address: int) -> list[int] | None:
        """Remove and return the oldest records of the queue at an address; None for no queue."""
        if self.ring is None or self.ring.fifo != address:
            return None
        self.rig.catch_up()
        return self.ring.take()

    def _values(self, sample: Samples) -> dict[str, float]:
        """Return the values of a sample's registers by quantity, SI units."""
        j = self.joint
        return {
            "sequence": sample.sequence[0] % (self.read.modulus("sequence") or 2**63),
            "time": sample.time[0] % (self.read.modulus("time") or np.inf),
            "angle": sample.angle[0, j],
            "velocity": sample.velocity[0, j],
            # A drive reports a current; a client multiplies it by the same constants of the rig
            # file.
            "current": sample.torque[0, j] / self.torque_per_ampere,
            "temperature": sample.temperature[0, j],
            # The present state, so that a control word shows at once, not at the next sample.
            "status": float(self.servo.status),
            "reference": sample.reference[0, j],
        }


class Sensor(Device):
    """A 3-axis force sensor in a cuff."""

    def __init__(self, rig: "VirtualRig", settings: SensorSettings, registers: SensorMap) -> None:
        self.read = Block(registers_of(registers.read))
        super().__init__(rig, settings.unit, registers.identity, (self.read,), registers.read)
        self.cuff = CUFFS.index(settings.cuff)

    def show(self, sample: Samples) -> None:
        """Put a sample into the registers."""
        x, y, z = sample.forces[0, self.cuff]
        sequence = sample.sequence[0] % (self.read.modulus("sequence") or 2**63)
        self._put(self.read, {"sequence": sequence, "force_x": x, "force_y": y, "force_z": z})
