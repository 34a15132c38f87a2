"""A machine that its own controller moves, as exoid reads it: rows with the instants of reading."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from math import isfinite

from pipelines.acquisition.machine.machine import all_answers
from pipelines.acquisition.modbus.blocks import BlockReader
from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line, lines_of
from pipelines.acquisition.modbus.one_client import greet
from pipelines.acquisition.modbus.wraparound import Unwrapper
from pipelines.contracts.joints import Joint
from pipelines.errors import DeviceError, Unanswered
from pipelines.settings.rig.devices import SensorSettings
from pipelines.settings.rig.recording_only import (
    ForceMap,
    JointMap,
    RecordedJoint,
    RecordingRig,
)


class ReadOnlyPart:
    """One device that is read, and never written to."""

    def __init__(
        self, rig: RecordingRig, settings: RecordedJoint | SensorSettings, line: Line
    ) -> None:
        self.settings = settings
        self.map: JointMap | ForceMap
        if isinstance(settings, RecordedJoint):
            name, self.map = f"drive {settings.joint}", rig.map.drive[settings.map]
        else:
            name, self.map = f"sensor {settings.cuff}", rig.map.sensor[settings.map]
        self.device = Device(name, settings.unit, line, rig.safety)
        self.reader = BlockReader(self.device, self.map.read)

    async def values(self, *, in_motion: bool = True) -> Mapping[str, float]:
        """Return its values, SI units, with the torque at the joint.

        Raises
        ------
        DeviceError
            No answer came in time, the device refused, or a value is no number.
        """
        values = self.reader.block.decode(await self.reader.read(in_motion=in_motion))
        for name, value in values.items():
            if not isfinite(value):
                raise DeviceError(
                    f"{self.device.label}: its {name} is {value}, expected a number; compare the"
                    " register map in the rig file with the device's manual"
                )
        settings = self.settings
        if isinstance(settings, RecordedJoint) and "torque" not in values:
            # The rig file is checked: a current comes with both.
            assert settings.torque_constant_nm_a and settings.gear_ratio
            values["torque"] = (
                values["current"] * settings.torque_constant_nm_a * settings.gear_ratio
            )
        return values


@dataclass(frozen=True)
class ReadOnlyRow:
    """Values of all devices, and when they were asked and had answered (host's clock, s)."""

    values: tuple[float, ...]
    """In the order of the columns, SI units."""
    asked: float
    answered: float
    sequence: int | None
    """Of the first device, without wraparound; None where it has no counter."""
    time: float | None
    """Clock of the first device, s, without wraparound; None where it has none."""


class ReadOnlyMachine:
    """All devices of a recording-only rig."""

    def __init__(self, rig: RecordingRig) -> None:
        line_of = lines_of(rig)
        self.parts = [ReadOnlyPart(rig, one, line_of(one)) for one in rig.drive]
        self.parts += [ReadOnlyPart(rig, one, line_of(one)) for one in rig.sensor]
        self._picked = [
            (k, quantity, Joint(joint.joint).column(quantity))
            for k, joint in enumerate(rig.drive)
            for quantity in rig.quantities_of(joint)
        ] + [
            (len(rig.drive) + k, f"force_{axis}", f"{sensor.cuff}_force_{axis}_n")
            for k, sensor in enumerate(rig.sensor)
            for axis in "xyz"
        ]
        first = self.parts[0].reader.block
        self.has_counter = "sequence" in first.names
        self.has_clock = "time" in first.names
        self._count = Unwrapper(first.span("sequence") if self.has_counter else 0.0)
        self._clock = Unwrapper(first.span("time") if self.has_clock else 0.0)
        self._newest = 0

    @property
    def columns(self) -> list[str]:
        """Names of the columns of its values."""
        return [column for *_, column in self._picked]

    async def connect(self) -> None:
        """Open every line and check the identity of every device."""
        for k, part in enumerate(self.parts):
            identity, read, device = part.map.identity, part.map.read, part.device
            earlier = [other.device for other in self.parts[:k]]
            await greet(device, earlier, partial(device.read_anything, identity, read))
            await device.check_identity(identity, read.function)
            await part.values(in_motion=False)

    async def count(self) -> int:
        """Return the first device's sample counter; the last known one without an answer."""
        part = self.parts[0]
        counter = part.reader.block.registers["sequence"]
        try:
            words = await part.device.read(
                counter.address, counter.registers, function=part.reader.function, in_motion=True
            )
        except Unanswered:
            return self._newest
        return self._note(part.reader.block.only("sequence").decode(words)["sequence"])

    async def row(self) -> ReadOnlyRow | None:
        """Read all devices at once; None where an answer is missing."""
        asked = time.perf_counter()
        try:
            values = await all_answers(part.values() for part in self.parts)
        except Unanswered:
            return None
        answered = time.perf_counter()
        first = values[0]
        return ReadOnlyRow(
            tuple(values[k][quantity] for k, quantity, _ in self._picked),
            asked,
            answered,
            self._note(first["sequence"]) if self.has_counter else None,
            self._clock(first["time"]) if self.has_clock else None,
        )

    def close(self) -> None:
        """Close every line."""
        for part in self.parts:
            part.device.line.close()

    def _note(self, sequence: float) -> int:
        self._newest = int(self._count(sequence))
        return self._newest
