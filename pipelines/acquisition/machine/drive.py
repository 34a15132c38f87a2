"""One drive: set-points out, readings in."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite

import numpy as np

from pipelines.acquisition.machine.clock_offset import Bounds
from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.modbus.ring_buffer import Queue, Ring
from pipelines.acquisition.modbus.wraparound import RATE_TOLERANCE, Counter, keeps_time
from pipelines.errors import DeviceError, Refused, SettingsError, Unanswered
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.devices import DriveSettings

WATCH_PAUSE_S = 0.05
"""From one look at a drive that may be driven to the next."""

STATUS_PAUSE_S = 0.002
"""Before a drive is asked again whether it has taken a control word."""

EMPTYING_S = 10.0
"""How long it may take to let go what has gathered in a drive's queue: thousands of records, a few
with each read."""

RATE_S = 0.5
"""How long a drive's counter and clock are watched before a run."""

WATCH_S = 0.5
"""How long a drive is watched that may be enabled before the run: whoever drives it tells it
something meanwhile."""
DRIVEN_RAD = 0.005
"""How far the angle of a drive goes in that time that somebody moves."""
COUNTED_WITH = ("sequence", "time", "status", "velocity", "temperature", "reference")
"""What a drive tells that must be a number."""


@dataclass(frozen=True, kw_only=True)
class Condition:
    """What a drive's status word tells."""

    enabled: bool | None = None
    """Whether the drive says that it follows its set-point; None for one that does not say."""
    fault: str | None = None
    """The fault that it reports, in words; None for none."""


@dataclass(frozen=True)
class Reading(Condition):
    """What a drive tells, SI units; NaN for what it does not."""

    sequence: int
    time: float
    angle: float
    torque: float
    current: float
    velocity: float
    temperature: float
    reference: float


class Drive:
    """One drive: set-points out, readings in."""

    def __init__(
        self, rig: RigSettings, settings: DriveSettings, line: Line, samples_per_cycle: int = 1
    ) -> None:
        self.settings = settings
        self.in_lockstep = rig.clock == "lockstep"
        self.map = rig.map.drive[settings.map]
        self.device = Device(f"drive {settings.joint}", settings.unit, line, rig.safety)
        self.read_block = Block(registers_of(self.map.read))
        self.write_block = Block(registers_of(self.map.write))
        self._counter = Block({"sequence": self.map.read.sequence})
        self._status = Block({"status": self.map.read.status or self.map.read.sequence})
        self._beats, self._beats_span = (
            0,
            int(self.write_block.span("heartbeat")) if self.map.write.heartbeat else 1,
        )
        self._control_s = rig.safety.control_s
        self._sequence = Counter(self.read_block.span("sequence"))
        self._time = Counter(self.read_block.span("time"))
        self.bounds: Bounds | None = None
        """Told of every reply, where somebody wants to know when the drive samples."""
        self.ring = self._its_ring(samples_per_cycle) if rig.sampling == "recorder" else None
        self.recorded = self._recorded()
        """Quantities that the samples which are kept of it hold."""
        self._temperature = np.nan
        self._sent = np.nan
        self._counted = 0
        self.was_sent = False
        """Whether any set-point was on its way to it; else it need not be disabled."""
        self.sent_at = 0.0
        """When it answered the last one, host's clock, s: where others are on its line, that may be
        late."""
        self.conditions: list[Condition] = []
        """What it has told that nobody has heeded yet: whoever asked may not have come to hear
        it."""

    def _its_ring(self, samples_per_cycle: int) -> Ring | Queue:
        settings = self.map.ring
        assert settings  # a rig file that asks for recorders has one for every drive
        self._ring_time = Counter(Block(registers_of(settings.record)).span("time"))
        if settings.fifo is not None:
            return Queue(self.device, settings, samples_per_cycle)
        return Ring(self.device, settings, self._newest, samples_per_cycle)

    def _recorded(self) -> frozenset[str]:
        if self.ring is None or self.map.ring is None:
            return frozenset({"angle", "torque", "current", "reference", *self.read_block.names})
        ring = registers_of(self.map.ring.record)
        return frozenset(
            {"angle", "torque", "current", *ring, *({"temperature"} & set(self.read_block.names))}
        )

    async def look(self, *, in_motion: bool = False) -> Reading:
        """Read without telling the drive anything."""
        sent = time.perf_counter()
        return self._reading(
            await self.device.read(
                self.read_block.address, self.read_block.count, in_motion=in_motion
            ),
            sent,
        )

    async def count(self) -> int:
        """Read the sample counter alone; without an answer it stands where it was."""
        sent = time.perf_counter()
        try:
            words = await self.device.read(
                self._counter.address, self._counter.count, in_motion=True
            )
        except Unanswered:
            return self._counted
        return self._newest(self._decoded(self._counter, words)["sequence"], sent)

    async def drain(self, newest: int) -> list[Reading]:
        """Return samples of its ring not returned before, up to the ``newest`` known to be there,
        oldest first."""
        assert self.ring  # who drains has looked at the rig file
        return [self._of_ring(number, record) for number, record in await self.ring.drain(newest)]

    async def forget_records(self) -> bool:
        """Let go what its record has kept so far, as far as one drain reaches; tell whether that
        was all."""
        return self.ring is None or await self.ring.forget()

    async def refuse_other_rate(self, rate_hz: float, setting: str) -> None:
        """Refuse a drive that does not take so many samples a second, by this computer's clock or
        by its own.

        Raises
        ------
        DeviceError
            Names the ``setting`` that tells the rate.
        """
        asked = time.perf_counter()
        first = await self.look()
        answered = time.perf_counter()
        await asyncio.sleep(RATE_S)
        asked_again = time.perf_counter()
        last = await self.look()
        longest, shortest = time.perf_counter() - asked, asked_again - answered
        samples, seconds = last.sequence - first.sequence, last.time - first.time
        # A sample more or less at either end; how late replies are does not matter.
        fewest = shortest * rate_hz * (1.0 - RATE_TOLERANCE) - 1.0
        most = longest * rate_hz * (1.0 + RATE_TOLERANCE) + 1.0
        if not fewest <= samples <= most:
            raise DeviceError(
                f"{self.device.label}: its sample counter goes up by"
                f" {samples / (0.5 * (shortest + longest)):.4g} a second, expected {rate_hz:g};"
                f" correct {setting}, or the rate that is set in the drive; nothing was moved"
            )
        if not keeps_time(samples, seconds, rate_hz):
            raise DeviceError(
                f"{self.device.label}: its clock went on by {seconds:.6f} s while its counter went"
                f" on by {samples} samples of {1.0 / rate_hz:.6f} s; correct the unit of time in"
                f" the rig file, or {setting}; nothing was moved"
            )

    async def empty_record(self) -> None:
        """Let go all that its record has kept so far, before anything moves.

        Raises
        ------
        DeviceError
            There is no end of it.
        """
        until = time.monotonic() + EMPTYING_S
        while not await self.forget_records():
            if time.monotonic() > until:
                raise DeviceError(
                    f"{self.device.label}: its queue is not empty after {EMPTYING_S:g} s in which"
                    " it was read without a pause, so it fills faster; raise the speed of its"
                    " line, give each drive a line of its own, or let it record less often"
                    " (record_rate_hz)"
                )

    def _newest(self, sequence: float, sent: float | None) -> int:
        """Return the number of the sample that a reply to a request of then tells, which may be its
        newest."""
        number = int(self._sequence(sequence))
        if sent is not None:
            if self.bounds:
                self.bounds.add(number, sent, time.perf_counter())
            self._counted = number
        return number

    async def exchange(self, reference: float, *, halt: bool = False) -> Reading:
        """Send a set-point (rad) and return the sample that is latched; ``halt`` where the leg is
        to stand there."""
        control = self.map.enable if self.map.halt is None or not halt else self.map.halt
        words = self.words(control, reference)
        self.was_sent = True
        # Nobody knows which set-point a drive follows that did not answer.
        before, self._sent = self._sent, np.nan
        sent = time.perf_counter()
        answer = await self.device.exchange(self.write_block, words, self.read_block)
        self._sent, self.sent_at = before, time.monotonic()
        reading = self._reading(answer, sent)
        self._sent = reference
        return reading

    async def disable(self, angle: float, *, in_motion: bool = False) -> None:
        """Take the torque away, and make sure of it; ``angle`` (rad) is where the leg stands or was
        sent."""
        await self._write_idle(self.map.disable, angle, in_motion=in_motion)
        if self.map.enabled_mask:
            await self._until(
                lambda status: not self._is_enabled(status), "to disable", "see its manual"
            )

    async def is_driven(self) -> bool:
        """Send whether somebody else drives it, by watching it for a while; one that says it is
        disabled nobody does.

        Nothing is written: a torque that is taken away comes back with the other's next set-point.
        """
        at_first = await self._asked()
        if self.map.enabled_mask and not self._is_enabled(int(at_first["status"])):
            return False
        until, first = time.monotonic() + WATCH_S, await self._asked_values()
        while time.monotonic() < until:
            await asyncio.sleep(WATCH_PAUSE_S)
            now = await self._asked_values()
            if now[0] != first[0] or not abs(now[1] - first[1]) <= DRIVEN_RAD:
                return True
        return False

    async def _asked(self) -> Mapping[str, float]:
        """Read what the drive tells, outside any exchange."""
        return self._decoded(
            self.read_block, await self.device.read(self.read_block.address, self.read_block.count)
        )

    async def _asked_values(self) -> tuple[object, float]:
        """Return what the drive has been told, as far as it tells, and its angle (rad)."""
        values = await self._asked()
        try:
            written: object = await self.device.read(
                self.write_block.address, self.write_block.count
            )
        except Refused:  # not every drive lets what is written be read; then its angle must tell
            written = None
        return written, values["angle"]

    async def make_idle(self) -> bool:
        """Disable the drive before a run, whatever it does; tell whether it said that it was
        enabled."""
        values = await self._asked()
        was_enabled = bool(self.map.enabled_mask) and self._is_enabled(int(values["status"]))
        await self.disable(values["angle"])
        return was_enabled

    async def reset_fault(self) -> None:
        """Clear a fault; a drive that reports none is told nothing.

        Raises
        ------
        SettingsError
            Where the rig file does not say how.
        DeviceError
            Where the drive keeps its fault.
        """
        values = await self._asked()
        if not int(values.get("status", 0)) & self.map.fault_mask:
            return
        if self.map.fault_reset is None:
            raise SettingsError(
                f"map.drive.{self.settings.map}.fault_reset: missing, but {self.device.label}"
                " reports a fault that is to be reset; give its control word, see the drive's"
                " manual"
            )
        try:
            await self._write_idle(self.map.fault_reset, values["angle"])
            await self._until(
                lambda status: not status & self.map.fault_mask,
                "to reset its fault",
                "see its manual",
            )
        except DeviceError:
            with suppress(DeviceError):  # the first one says what is wrong
                await self._write_idle(self.map.disable, values["angle"])
            raise
        await self._write_idle(self.map.disable, values["angle"])

    def words(self, control: int, reference: float) -> list[int]:
        """Return the registers that tell a control word and a set-point (rad).

        Raises
        ------
        DeviceError
            The set-point is no number, or outside the joint's limits.
        """
        low, high = self.settings.angle_rad
        if not low <= reference <= high:
            raise DeviceError(
                f"{self.device.label}: a set-point of {reference:.3f} rad was due, outside its"
                f" limits {low:g} to {high:g} rad; it was not sent"
            )
        # Within the limits once rounded, too: what is half a count from a limit may be rounded
        # beyond it.
        half = self.map.write.reference.step / 2.0
        return self._encoded(control, min(max(reference, low + half), high - half))

    async def idle_words(self, control: int, angle: float) -> list[int]:
        """Return the registers that tell a control word to a drive that is not to follow, its leg
        at ``angle`` (rad).

        Where that can be no set-point, the one that the drive holds already is told again.
        """
        low, high = self.settings.angle_rad
        if low <= angle <= high:
            return self.words(control, angle)
        held = self.write_block.decode(
            await self.device.read(self.write_block.address, self.write_block.count)
        )
        return self._encoded(control, held["reference"])

    async def _write_idle(self, control: int, angle: float, *, in_motion: bool = False) -> None:
        await self.device.write(
            self.write_block, await self.idle_words(control, angle), in_motion=in_motion
        )

    def _encoded(self, control: int, reference: float) -> list[int]:
        self._beats = (self._beats + 1) % self._beats_span
        return self.write_block.encode(
            {"reference": reference, "control": control, "heartbeat": self._beats}
        )

    def _is_enabled(self, status: int) -> bool:
        return status & self.map.enabled_mask == self.map.enabled_value

    async def _until(self, has_taken: Callable[[int], bool], what: str, remedy: str) -> None:
        """Read the status word until it shows that a control word was taken."""
        until = time.monotonic() + self._control_s
        while True:
            # Never for long: others on the line may still be moving.
            words = await self.device.read(self._status.address, self._status.count, in_motion=True)
            status = int(self._decoded(self._status, words)["status"])
            if has_taken(status):
                return
            if time.monotonic() > until:
                raise DeviceError(
                    f"{self.device.label}: was told {what}, but its status word is still"
                    f" 0x{status:04X} after {self._control_s:g} s (safety.control_s); {remedy}"
                )
            await asyncio.sleep(STATUS_PAUSE_S)

    def _decoded(self, block: Block, words: list[int]) -> Mapping[str, float]:
        """Decode words."""
        return self._numbers(block.decode(words))

    def _numbers(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """Refuse what is no number where that is counted with, or would mean that the drive does
        not tell it."""
        for name in COUNTED_WITH:
            if not isfinite(values.get(name, 0.0)):
                raise DeviceError(
                    f"{self.device.label}: its {name} is {values[name]}, expected a number; compare"
                    " the register map in the rig file with the device's manual"
                )
        return values

    def _reading(self, words: list[int], sent: float) -> Reading:
        values = self.read_block.decode(words)
        # Heeded whatever else it tells that is no number.
        self.conditions.append(condition := self._condition(values.get("status", 0.0)))
        numbers = self._numbers(values)
        self._temperature = numbers.get("temperature", np.nan)
        number = self._newest(numbers["sequence"], sent)
        return self._sample(number, self._time(numbers["time"]), numbers, self._sent, condition)

    def _condition(self, status: float) -> Condition:
        """Return what a status word tells; of one that is no number nothing."""
        if not isfinite(status):
            return Condition()
        enabled = self._is_enabled(int(status)) if self.map.enabled_mask else None
        return Condition(enabled=enabled, fault=self._fault(int(status)))

    def _fault(self, status: int) -> str | None:
        """Return in words the fault that a status word tells; None where it tells none."""
        if not (bits := self.map.active_faults(status)):
            return None
        reset = (
            ""
            if self.map.fault_reset is None
            else ", with --reset-faults where the drive is to clear it"
        )
        return (
            f"{self.device.label}: reports a fault (status bits {bits}); see the drive's manual, "
            f"clear the fault and start again{reset}"
        )

    def _of_ring(self, number: int, values: Mapping[str, float]) -> Reading:
        """Return a record as a sample; temperature is what the last exchange told."""
        values = self._numbers(values)
        return self._sample(number, self._ring_time(values["time"]), values, np.nan, Condition())

    def _sample(
        self,
        number: int,
        time_s: float,
        values: Mapping[str, float],
        sent: float,
        condition: Condition,
    ) -> Reading:
        """Return what a drive tells as a sample; ``sent`` is its set-point (rad) where it tells
        none."""
        return Reading(
            sequence=number,
            time=time_s,
            angle=values["angle"],
            torque=values["current"] * self.settings.torque_per_ampere,
            current=values["current"],
            velocity=values.get("velocity", np.nan),
            temperature=self._temperature,
            reference=values.get("reference", sent),
            **vars(condition),
        )


Send = Callable[[Drive], Awaitable[Reading]]
"""Sends a drive its set-point and returns the sample that is latched."""
