"""A machine that its own controller moves, as exoid reads it: rows with the instants of reading."""

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite

from pipelines.acquisition.machine.machine import all_answers
from pipelines.acquisition.machine.progress import Progress
from pipelines.acquisition.machine.turns import FollowedAngle
from pipelines.acquisition.modbus.blocks import BlockReader
from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line, lines_of
from pipelines.acquisition.modbus.one_client import greet
from pipelines.acquisition.modbus.wraparound import unwrap
from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.contracts.joints import Joint
from pipelines.errors import DeviceError
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
        self,
        rig: RecordingRig,
        settings: RecordedJoint | SensorSettings,
        line: Line,
        *,
        turns: bool = False,
    ) -> None:
        """Prepare reading; the angle of a joint that ``turns`` without end has no limit."""
        self.settings = settings
        self.map: JointMap | ForceMap
        if isinstance(settings, RecordedJoint):
            name, self.map = f"drive {settings.joint}", rig.map.drive[settings.map]
        else:
            name, self.map = f"sensor {settings.cuff}", rig.map.sensor[settings.map]
        line.reopens = True
        self.device = Device(name, settings.unit, line, rig.safety)
        self.reader = BlockReader(self.device, self.map.read)
        angle = self.reader.block.registers.get("angle")
        self._turn = angle.turn if angle else 0.0
        self._followed = FollowedAngle(self._turn)
        self._is_limited = not (turns or self._turn)

    async def begin(self, earlier: Sequence[Device]) -> None:
        """Connect, check its identity, and read it once.

        Parameters
        ----------
        earlier : sequence of Device
            Those that are connected.

        Raises
        ------
        DeviceError
            It does not answer, refuses, or is another device.
        """
        identity, read = self.map.identity, self.map.read
        await greet(self.device, earlier, partial(self.device.read_anything, identity, read))
        await self.device.check_identity(identity, read.function)
        await self.values(in_motion=False)

    async def values(self, *, in_motion: bool = True) -> Mapping[str, float]:
        """Return its values, SI units, with the torque at the joint.

        Raises
        ------
        DeviceError
            No answer came in time, the device refused, a value is no number, or an angle is
            larger than a recording may hold.
        """
        values = self.reader.block.decode(await self.reader.read(in_motion=in_motion))
        for name, value in values.items():
            if not isfinite(value):
                raise DeviceError(
                    f"{self.device.label}: its {name} is {value}, expected a number; compare the"
                    " register map in the rig file with the device's manual"
                )
            is_angle = name in ("angle", "reference")
            if is_angle and self._is_limited and abs(value) > LARGEST_ANGLE_RAD:
                raise DeviceError(
                    f"{self.device.label}: its {name} is {value:.4g} rad, and a recording holds at"
                    f" most {LARGEST_ANGLE_RAD:.4g}; `exoid rig check` tries other addresses, types"
                    " and word orders. A joint without end needs turns = true in [mechanism]"
                )
        if self._turn:
            values |= self._with_turns(values)
        settings = self.settings
        if isinstance(settings, RecordedJoint) and "torque" not in values:
            # The rig file is checked: a current comes with both.
            assert settings.torque_constant_nm_a and settings.gear_ratio
            values["torque"] = (
                values["current"] * settings.torque_constant_nm_a * settings.gear_ratio
            )
        return values

    def _with_turns(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the angle with its turns, and the set-point near it."""
        angle = self._followed.take(values["angle"], time.perf_counter())
        if angle is None:
            raise DeviceError(
                f"{self.device.label}: its angle is over a quarter of a turn from where its speed"
                " leads, so that its turns cannot be counted; raise acquire.sample_rate_hz, or"
                " correct read.angle.wraps_at"
            )
        if "reference" not in values:
            return {"angle": angle}
        return {"angle": angle, "reference": unwrap(values["reference"], angle, self._turn)}


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

    def __init__(
        self, rig: RecordingRig, rate_hz: float = 1.0, turning: Collection[str] = ()
    ) -> None:
        """Prepare reading.

        Parameters
        ----------
        rig : RecordingRig
            The devices.
        rate_hz : float, optional
            Rate of their counters for rows.
        turning : collection of str, optional
            Joints that turn without end.
        """
        line_of = lines_of(rig)
        self.parts = [
            ReadOnlyPart(rig, one, line_of(one), turns=one.joint in turning) for one in rig.drive
        ]
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
        self._progress = [
            Progress(part.device.label, part.reader.block, rate_hz)
            if "sequence" in part.reader.block.names
            else None
            for part in self.parts
        ]

    def long_integers(self) -> dict[int, float]:
        """Return the high words per SI unit of those of a row's values that are long integers."""
        registers = [
            self.parts[k].reader.block.registers.get(quantity) for k, quantity, _ in self._picked
        ]
        return {
            at: 1.0 / (one.step * one.word)
            for at, one in enumerate(registers)
            if one is not None and one.counts is not None and one.registers > 1
        }

    def angles_that_go_on(self) -> list[int]:
        """Return the indices of the angles in a row that do not start again after a turn."""
        return [
            at
            for at, (k, quantity, _) in enumerate(self._picked)
            if quantity == "angle" and not self.parts[k].reader.block.registers[quantity].turn
        ]

    @property
    def columns(self) -> list[str]:
        """Names of the columns of its values."""
        return [column for *_, column in self._picked]

    async def connect(self) -> None:
        """Open every line and check the identity of every device."""
        for k, part in enumerate(self.parts):
            earlier = [other.device for other in self.parts[:k]]
            try:
                await part.begin(earlier)
            except DeviceError:  # one answer may be lost, or the device busy
                await part.begin(earlier)

    async def row(self) -> ReadOnlyRow:
        """Read all devices at once.

        Raises
        ------
        DeviceError
            An answer is missing, or is not credible.
        """
        asked = time.perf_counter()
        values = await all_answers(part.values() for part in self.parts)
        answered = time.perf_counter()
        instants = [
            progress and progress.note(of_part, asked, answered)
            for progress, of_part in zip(self._progress, values, strict=True)
        ]
        first = instants[0]
        return ReadOnlyRow(
            tuple(values[k][quantity] for k, quantity, _ in self._picked),
            asked,
            answered,
            first.sequence if first else None,
            first.time if first else None,
        )

    def close(self) -> None:
        """Close every line."""
        for part in self.parts:
            part.device.line.close()
