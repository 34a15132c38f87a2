"""The rig as acquisition sees it: drives and force sensors that together deliver one row a cycle."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.clocks import Bounds
from pipelines.acquisition.counter import RATE_TOLERANCE, Counter, keeps_time
from pipelines.acquisition.device import Device
from pipelines.acquisition.line import Line, lines_of
from pipelines.acquisition.patience import Patience
from pipelines.acquisition.ring import Queue, Ring
from pipelines.errors import DeviceError, Refused, SettingsError, Unanswered
from pipelines.mechanics.motion import CUFFS
from pipelines.registers import Block
from pipelines.settings.rig import DriveSettings, RigSettings, SensorSettings, registers_of

LAG_PAUSE_S = 0.0002
"""Before a drive is asked again that has not latched its sample yet."""

WATCH_PAUSE_S = 0.05
"""From one look at a drive that may be driven to the next."""

STATUS_PAUSE_S = 0.002
"""Before a drive is asked again whether it has taken a control word."""

EMPTYING_S = 10.0
"""How long it may take to let go what has gathered in a drive's queue: thousands of records, a few with each read."""

RATE_S = 0.5
"""How long a drive's counter and clock are watched before a run."""

WATCH_S = 0.5
"""How long a drive is watched that may be enabled before the run: whoever drives it tells it something meanwhile."""
DRIVEN_RAD = 0.005
"""How far the angle of a drive goes in that time that somebody moves."""

LOOKS = 9
"""Readings from which the distance between the drives' counters is taken."""
SAME_TIME = 0.1
"""Share of a sample within which the clocks of drives that sample together tell the same time."""
MOST_LOOKS = 200
"""How many it may take where samples come faster than replies."""


Answer = TypeVar("Answer")


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

    def __init__(self, rig: RigSettings, settings: DriveSettings, line: Line, samples_per_cycle: int = 1) -> None:
        self.settings = settings
        self.in_lockstep = rig.clock == "lockstep"
        self.map = rig.map.drive[settings.map]
        self.device = Device(f"drive {settings.joint}", settings.unit, line, rig.safety)
        self.told = Block(registers_of(self.map.read))
        self.tell = Block(registers_of(self.map.write))
        self._counter = Block({"sequence": self.map.read.sequence})
        self._status = Block({"status": self.map.read.status or self.map.read.sequence})
        self._beats, self._beats_span = 0, int(self.tell.span("heartbeat")) if self.map.write.heartbeat else 1
        self._control_s = rig.safety.control_s
        self._sequence = Counter(self.told.span("sequence"))
        self._time = Counter(self.told.span("time"))
        self.bounds: Bounds | None = None
        """Told of every reply, where somebody wants to know when the drive samples."""
        self.ring = self._its_ring(samples_per_cycle) if rig.sampling == "recorder" else None
        self.recorded = self._recorded()
        """Quantities that the samples which are kept of it hold."""
        self._temperature = np.nan
        self._sent = np.nan
        self._counted = 0
        self.was_told = False
        """Whether any set-point was on its way to it; else it need not be disabled."""
        self.told_at = 0.0
        """When it answered the last one, host's clock, s: where others are on its line, that may be late."""
        self.conditions: list[Condition] = []
        """What it has told that nobody has heeded yet: whoever asked may not have come to hear it."""

    def _its_ring(self, samples_per_cycle: int) -> Ring | Queue:
        settings = self.map.ring
        assert settings  # a rig file that asks for recorders has one for every drive
        self._ring_time = Counter(Block(registers_of(settings.record)).span("time"))
        if settings.fifo is not None:
            return Queue(self.device, settings, samples_per_cycle)
        return Ring(self.device, settings, self._newest, samples_per_cycle)

    def _recorded(self) -> frozenset[str]:
        if self.ring is None or self.map.ring is None:
            return frozenset({"angle", "torque", "current", "reference", *self.told.names})
        ring = registers_of(self.map.ring.record)
        return frozenset({"angle", "torque", "current", *ring, *({"temperature"} & set(self.told.names))})

    async def look(self, *, in_motion: bool = False) -> Reading:
        """Read without telling the drive anything."""
        sent = time.perf_counter()
        return self._reading(await self.device.read(self.told.address, self.told.count, in_motion=in_motion), sent)

    async def count(self) -> int:
        """Read the sample counter alone; without an answer it stands where it was."""
        sent = time.perf_counter()
        try:
            words = await self.device.read(self._counter.address, self._counter.count, in_motion=True)
        except Unanswered:
            return self._counted
        return self._newest(self._decoded(self._counter, words)["sequence"], sent)

    async def drain(self, newest: int) -> list[Reading]:
        """Return samples of its ring not returned before, up to the ``newest`` known to be there, oldest first."""
        assert self.ring  # who drains has looked at the rig file
        return [self._of_ring(number, record) for number, record in await self.ring.drain(newest)]

    async def forget_records(self) -> bool:
        """Let go what its record has kept so far, as far as one drain reaches; tell whether that was all."""
        return self.ring is None or await self.ring.forget()

    async def refuse_other_rate(self, rate_hz: float, setting: str) -> None:
        """Refuse a drive that does not take so many samples a second, by this computer's clock or by its own.

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
                f"{self.device.label}: its sample counter goes up by {samples / (0.5 * (shortest + longest)):.4g} a "
                f"second, expected {rate_hz:g}; correct {setting}, or the rate that is set in the drive; nothing was "
                "moved"
            )
        if not keeps_time(samples, seconds, rate_hz):
            raise DeviceError(
                f"{self.device.label}: its clock went on by {seconds:.6f} s while its counter went on by {samples} "
                f"samples of {1.0 / rate_hz:.6f} s; correct the unit of time in the rig file, or {setting}; nothing "
                "was moved"
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
                    f"{self.device.label}: its queue is not empty after {EMPTYING_S:g} s in which it was read without "
                    "a pause, so it fills faster; raise the speed of its line, give each drive a line of its own, or "
                    "let it record less often (record_rate_hz)"
                )

    def _newest(self, sequence: float, sent: float | None) -> int:
        """Return the number of the sample that a reply to a request of then tells, which may be its newest."""
        number = int(self._sequence(sequence))
        if sent is not None:
            if self.bounds:
                self.bounds.told(number, sent, time.perf_counter())
            self._counted = number
        return number

    async def exchange(self, reference: float, *, halt: bool = False) -> Reading:
        """Send a set-point (rad) and return the sample that is latched; ``halt`` where the leg is to stand there."""
        control = self.map.enable if self.map.halt is None or not halt else self.map.halt
        words = self.words(control, reference)
        self.was_told = True
        # Nobody knows which set-point a drive follows that did not answer.
        before, self._sent = self._sent, np.nan
        sent = time.perf_counter()
        answer = await self.device.exchange(self.tell, words, self.told)
        self._sent, self.told_at = before, time.monotonic()
        reading = self._reading(answer, sent)
        self._sent = reference
        return reading

    async def disable(self, angle: float, *, in_motion: bool = False) -> None:
        """Take the torque away, and make sure of it; ``angle`` (rad) is where the leg stands or was sent."""
        await self._tell_idle(self.map.disable, angle, in_motion=in_motion)
        if self.map.enabled_mask:
            await self._until(lambda status: not self._is_enabled(status), "to disable", "see its manual")

    async def is_driven(self) -> bool:
        """Tell whether somebody else drives it, by watching it for a while; one that says it is disabled nobody does.

        Nothing is written: a torque that is taken away comes back with the other's next set-point.
        """
        told = await self._asked()
        if self.map.enabled_mask and not self._is_enabled(int(told["status"])):
            return False
        until, first = time.monotonic() + WATCH_S, await self._all_told()
        while time.monotonic() < until:
            await asyncio.sleep(WATCH_PAUSE_S)
            now = await self._all_told()
            if now[0] != first[0] or not abs(now[1] - first[1]) <= DRIVEN_RAD:
                return True
        return False

    async def _asked(self) -> Mapping[str, float]:
        """Read what the drive tells, outside any exchange."""
        return self._decoded(self.told, await self.device.read(self.told.address, self.told.count))

    async def _all_told(self) -> tuple[object, float]:
        """Return what the drive has been told, as far as it tells, and its angle (rad)."""
        told = await self._asked()
        try:
            written: object = await self.device.read(self.tell.address, self.tell.count)
        except Refused:  # not every drive lets what is written be read; then its angle must tell
            written = None
        return written, told["angle"]

    async def make_idle(self) -> bool:
        """Disable the drive before a run, whatever it does; tell whether it said that it was enabled."""
        told = await self._asked()
        was_enabled = bool(self.map.enabled_mask) and self._is_enabled(int(told["status"]))
        await self.disable(told["angle"])
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
        told = await self._asked()
        if not int(told.get("status", 0)) & self.map.fault_mask:
            return
        if self.map.fault_reset is None:
            raise SettingsError(
                f"map.drive.{self.settings.map}.fault_reset: missing, but {self.device.label} reports a fault that is "
                "to be reset; give its control word, see the drive's manual"
            )
        try:
            await self._tell_idle(self.map.fault_reset, told["angle"])
            await self._until(lambda status: not status & self.map.fault_mask, "to reset its fault", "see its manual")
        except DeviceError:
            with suppress(DeviceError):  # the first one says what is wrong
                await self._tell_idle(self.map.disable, told["angle"])
            raise
        await self._tell_idle(self.map.disable, told["angle"])

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
                f"{self.device.label}: a set-point of {reference:.3f} rad was due, outside its limits {low:g} to "
                f"{high:g} rad; it was not sent"
            )
        # Within the limits once rounded, too: what is half a count from a limit may be rounded beyond it.
        half = self.map.write.reference.step / 2.0
        return self._encoded(control, min(max(reference, low + half), high - half))

    async def idle_words(self, control: int, angle: float) -> list[int]:
        """Return the registers that tell a control word to a drive that is not to follow, its leg at ``angle`` (rad).

        Where that can be no set-point, the one that the drive holds already is told again.
        """
        low, high = self.settings.angle_rad
        if low <= angle <= high:
            return self.words(control, angle)
        held = self.tell.decode(await self.device.read(self.tell.address, self.tell.count))
        return self._encoded(control, held["reference"])

    async def _tell_idle(self, control: int, angle: float, *, in_motion: bool = False) -> None:
        await self.device.write(self.tell, await self.idle_words(control, angle), in_motion=in_motion)

    def _encoded(self, control: int, reference: float) -> list[int]:
        self._beats = (self._beats + 1) % self._beats_span
        return self.tell.encode({"reference": reference, "control": control, "heartbeat": self._beats})

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
                    f"{self.device.label}: was told {what}, but its status word is still 0x{status:04X} after "
                    f"{self._control_s:g} s (safety.control_s); {remedy}"
                )
            await asyncio.sleep(STATUS_PAUSE_S)

    def _decoded(self, block: Block, words: list[int]) -> Mapping[str, float]:
        """Decode words."""
        return self._numbers(block.decode(words))

    def _numbers(self, told: Mapping[str, float]) -> Mapping[str, float]:
        """Refuse what is no number where that is counted with, or would mean that the drive does not tell it."""
        for name in ("sequence", "time", "status", "velocity", "temperature", "reference"):
            if not np.isfinite(told.get(name, 0.0)):
                raise DeviceError(
                    f"{self.device.label}: its {name} is {told[name]}, expected a number; compare the register map in "
                    "the rig file with the device's manual"
                )
        return told

    def _reading(self, words: list[int], sent: float) -> Reading:
        values = self.told.decode(words)
        # Heeded whatever else it tells that is no number.
        self.conditions.append(condition := self._condition(values.get("status", 0.0)))
        told = self._numbers(values)
        self._temperature = told.get("temperature", np.nan)
        return Reading(
            sequence=self._newest(told["sequence"], sent),
            time=self._time(told["time"]),
            angle=told["angle"],
            torque=told["current"] * self.settings.torque_per_ampere,
            current=told["current"],
            velocity=told.get("velocity", np.nan),
            temperature=self._temperature,
            reference=told.get("reference", self._sent),
            **vars(condition),
        )

    def _condition(self, status: float) -> Condition:
        """Return what a status word tells; of one that is no number nothing."""
        if not np.isfinite(status):
            return Condition()
        enabled = self._is_enabled(int(status)) if self.map.enabled_mask else None
        return Condition(enabled=enabled, fault=self._fault(int(status)))

    def _fault(self, status: int) -> str | None:
        """Return in words the fault that a status word tells; None where it tells none."""
        if not (bits := self.map.told_faults(status)):
            return None
        reset = "" if self.map.fault_reset is None else ", with --reset-faults where the drive is to clear it"
        return (
            f"{self.device.label}: reports a fault (status bits {bits}); see the drive's manual, "
            f"clear the fault and start again{reset}"
        )

    def _of_ring(self, number: int, told: Mapping[str, float]) -> Reading:
        """Return a record as a sample; temperature is what the last exchange told."""
        told = self._numbers(told)
        return Reading(
            sequence=number,
            time=self._ring_time(told["time"]),
            angle=told["angle"],
            torque=told["current"] * self.settings.torque_per_ampere,
            current=told["current"],
            velocity=told.get("velocity", np.nan),
            temperature=self._temperature,
            reference=told.get("reference", np.nan),
        )


Tell = Callable[[Drive], Awaitable[Reading]]
"""Sends a drive its set-point and returns the sample that is latched."""


class Sensor:
    """One 3-axis force sensor."""

    def __init__(self, rig: RigSettings, settings: SensorSettings, line: Line) -> None:
        self.settings = settings
        self.map = rig.map.sensor[settings.map]
        self.device = Device(f"sensor {settings.cuff}", settings.unit, line, rig.safety)
        self.block = Block(registers_of(self.map.read))
        self._turn = rig.turn_of(settings)
        self._patience = Patience(rig.safety.watchdog_s)
        self._last: float | None = None
        self._owes = False
        """Whether an answer of it may still come that another request's would be taken for."""

    def is_due(self, cycle: int) -> bool:
        """Tell whether it is read in a cycle."""
        return cycle % self.settings.every == self._turn

    async def look(self) -> tuple[float, float, float] | None:
        """Return the force (N), or None where the sensor has no new sample or, for once, does not answer.

        Raises
        ------
        DeviceError
            It has not answered for too long; never Unanswered, which is survived.
        """
        self._patience.waited(time.monotonic())
        try:
            told = self.block.decode(await self.device.read(self.block.address, self.block.count, in_motion=True))
        except Unanswered as error:
            if self._patience.is_over(time.monotonic()):
                raise DeviceError(str(error)) from error
            self._owes = not self.device.line.tells_replies_apart
            return None
        self._patience.hear(time.monotonic())
        owed, self._owes = self._owes, False
        stale, self._last = told["sequence"] == self._last, told["sequence"]
        return None if stale or owed else (told["force_x"], told["force_y"], told["force_z"])


@dataclass(frozen=True)
class Row:
    """One sample of the whole machine."""

    drives: tuple[Reading, ...]
    forces: NDArray
    """(4, 3) N; NaN where a sensor was not read or had nothing new."""
    samples_per_cycle: int = 1

    @property
    def sequence(self) -> int:
        """The cycle it belongs to: the first drive's sample counter is the machine's."""
        return self.drives[0].sequence // self.samples_per_cycle

    @property
    def time(self) -> float:
        """The first drive's clock: the machine's, s."""
        return self.drives[0].time

    @property
    def angle(self) -> list[float]:
        """Angle of each joint, rad."""
        return [drive.angle for drive in self.drives]


@dataclass(frozen=True)
class Answers:
    """What one cycle brought, whole or not."""

    drives: tuple[Reading | Unanswered, ...]
    """Of a drive that did not answer in time, the error that says so."""
    forces: NDArray
    """(4, 3) N; NaN where a sensor was not read or had nothing new."""
    row: Row | None
    """The sample of the whole machine; None where a drive's is missing."""


class Machine:
    """All devices of a rig."""

    def __init__(self, rig: RigSettings, *, with_sensors: bool, samples_per_cycle: int = 1) -> None:
        """Take the devices of a rig; drives take so many samples from one set-point to the next."""
        self.rig = rig
        line_of = lines_of(rig)
        self.drives = [Drive(rig, settings, line_of(settings), samples_per_cycle) for settings in rig.drive]
        self.sensors = [Sensor(rig, settings, line_of(settings)) for settings in rig.sensor] if with_sensors else []
        self.samples_per_cycle = samples_per_cycle
        self._latches = rig.sampling == "cyclic" and rig.clocks == "common"
        self._parts: list[Drive | Sensor] = [*self.drives, *self.sensors]
        self.no_force = np.full((len(CUFFS), 3), np.nan)
        self.leads = [0 for _ in self.drives]
        """How far each drive's counter is ahead of the first one's at the same sample."""
        self.leads_are_vague = False
        """Whether a slow line hides by how many samples."""
        self._counted = 0
        """At which count all drives were at the end of the last cycle."""

    async def connect(self) -> None:
        """Open every line and make sure who is at its end."""
        for part in self._parts:
            await part.device.line.connect()
            await part.device.check_identity(part.map.identity)

    async def refuse_driven(self) -> None:
        """Refuse to write anything to a rig that somebody else drives."""
        driven = await all_answers(drive.is_driven() for drive in self.drives)
        if found := [drive.device.label for drive, is_so in zip(self.drives, driven, strict=True) if is_so]:
            raise DeviceError(
                f"{' and '.join(found)}: driven by somebody else, since angle or set-point change while exoid sends "
                "nothing; end the other program, or hold the leg still; nothing was sent"
            )

    async def reset_faults(self) -> None:
        """Clear the faults that drives report."""
        for drive in self.drives:
            await drive.reset_fault()

    async def make_idle(self) -> None:
        """Disable every drive before a run; refuse to go on where one was enabled: nobody knows what moved the leg."""
        found = [drive.device.label for drive in self.drives if await drive.make_idle()]
        if found:
            raise DeviceError(
                f"{' and '.join(found)}: enabled before the run began, by one that was killed perhaps; disabled now; "
                "see to the leg, and to what else moves it, and start again"
            )

    async def refuse_other_rate(self, cycle_hz: float) -> None:
        """Refuse drives that do not sample at the rate that is wanted; in lockstep each exchange is a sample."""
        if self.rig.clock == "lockstep":
            return
        setting = "acquire.sample_rate_hz" if self.rig.sampling == "cyclic" else "record_rate_hz in the rig file"
        rate_hz = cycle_hz * self.samples_per_cycle
        await all_answers(drive.refuse_other_rate(rate_hz, setting) for drive in self.drives)

    async def empty_records(self) -> None:
        """Let go what the drives' own records have kept so far: a queue that nobody read is full of what is past."""
        await all_answers(drive.empty_record() for drive in self.drives)

    async def forget_records(self) -> None:
        """Let go what has come to the drives' own records, without a pause for long; what is left waits."""
        with suppress(Unanswered):
            await all_answers(drive.forget_records() for drive in self.drives)

    def close(self) -> None:
        """Close every line."""
        for part in self._parts:
            part.device.line.close()

    async def look(self) -> Row:
        """Read every device once, moving nothing.

        Raises
        ------
        DeviceError
            Where a drive reports a fault.
        """
        # Several looks: between two requests of one of them a drive may go on to its next sample.
        looks = [await asyncio.gather(*(drive.look() for drive in self.drives)) for _ in range(LOOKS)]
        for reading in looks[-1]:
            if reading.fault:
                raise DeviceError(reading.fault)
        ahead = np.array([[reading.sequence - look[0].sequence for reading in look] for look in looks])
        self.leads = np.median(ahead, axis=0).astype(int).tolist()
        if self.rig.sampling == "recorder" and self.rig.clock == "real_time" and self.rig.clocks == "common":
            await self._find_leads()
        self._counted = looks[-1][0].sequence
        return Row(tuple(looks[-1]), await self.felt(), self.samples_per_cycle)

    async def _find_leads(self) -> None:
        """Find out how far the counters are apart though they go on while one drive after the other is asked.

        Replies bound it. Where the drives' clocks tell a distance within these bounds, they show the same time, and
        it is that; else the bounds must be narrow enough to leave one.
        """
        rate_hz = self.rig.record_rate_hz
        assert rate_hz  # a rig file that asks for recorders has it
        bounds = [Bounds(1.0 / rate_hz) for _ in self.drives]
        for drive, its in zip(self.drives, bounds, strict=True):
            drive.bounds = its
        try:
            for _ in range(MOST_LOOKS):
                readings = await asyncio.gather(*(drive.look() for drive in self.drives))
                (origin, width), *others = [its.now() for its in bounds]
                leads = [
                    _lead(
                        (origin - other[0]) * rate_hz, (width + other[1]) * rate_hz / 2, readings[0], reading, rate_hz
                    )
                    for other, reading in zip(others, readings[1:], strict=True)
                ]
                self.leads_are_vague = None in leads
                if not self.leads_are_vague:
                    break
        finally:
            for drive in self.drives:
                drive.bounds = None
        self.leads = [0, *(lead or 0 for lead in leads)]

    async def count(self) -> int:
        """Return the cycle that the first drive is in."""
        return await self.drives[0].count() // self.samples_per_cycle

    async def cycle(self, number: int, tell: Tell) -> Answers:
        """Tell all drives at once; return what came: the sample that all devices latched, or of each its newest.

        In lockstep the drives' exchange ends a sample, so sensors are read before it. In real time the drives
        tell when a new sample begins, so sensors are read after it. Nothing is sent twice, for a set-point that comes
        late is no set-point.
        """
        if self.rig.clock == "lockstep":
            forces = await self.felt(number)
            told = await answers_or_silence(map(tell, self.drives))
        else:
            told = await answers_or_silence(map(tell, self.drives))
            forces = await self.felt(number)
        readings = [answer for answer in told if isinstance(answer, Reading)]
        whole = len(readings) == len(told)
        if whole and self._latches:
            whole = await self._latch(readings)
            told = list(readings)
        row = Row(tuple(readings), forces, self.samples_per_cycle) if whole else None
        return Answers(tuple(told), forces, row)

    async def felt(self, cycle: int | None = None) -> NDArray:
        """Return the forces (4, 3) N of those sensors that are due in a cycle, without one of all."""
        due = [sensor for sensor in self.sensors if cycle is None or sensor.is_due(cycle)]
        if not due:
            return self.no_force
        forces = self.no_force.copy()
        for sensor, force in zip(due, await all_answers(sensor.look() for sensor in due), strict=True):
            if force is not None:
                forces[CUFFS.index(sensor.settings.cuff)] = force
        return forces

    async def _latch(self, readings: list[Reading]) -> bool:
        """Ask those drives again that have not latched the others' sample yet.

        Returns whether all have latched it in the end; not, where one does not answer.
        """
        until = time.monotonic() + self.rig.safety.watchdog_s
        while True:
            counts = [reading.sequence - ahead for reading, ahead in zip(readings, self.leads, strict=True)]
            late = [j for j, count in enumerate(counts) if count < max(counts)]
            if not late:
                self._counted = max(counts)
                return True
            if time.monotonic() > until:
                raise DeviceError(self._out_of_step(readings, counts))
            await asyncio.sleep(LAG_PAUSE_S)
            for j in late:
                # Not told again: what is due by then is another set-point.
                try:
                    readings[j] = await self.drives[j].look(in_motion=True)
                except Unanswered:
                    return False

    def _out_of_step(self, readings: Sequence[Reading], counts: Sequence[int]) -> str:
        """Return in words which drive's counter has parted from the others', and how."""
        slow, fast = int(np.argmin(counts)), int(np.argmax(counts))
        gained = [count - self._counted for count in counts]
        # Whichever goes on as before is right.
        j, other = (fast, slow) if gained[slow] > 0 else (slow, fast)
        what = "leapt" if gained[slow] > 0 else "went back" if gained[slow] < 0 else "stands still"
        return (
            f"{self.drives[j].device.label}: its sample counter {what} ({readings[j].sequence - gained[j]}, then "
            f"{readings[j].sequence}) while that of drive {self.rig.drive[other].joint} went on by {gained[other]} in "
            f'{self.rig.safety.watchdog_s:g} s; was it restarted? Or set clocks = "own" in the rig file, if each drive '
            "has a clock of its own"
        )


async def answers_or_silence(asked: Iterable[Awaitable[Answer]]) -> list[Answer | Unanswered]:
    """Return each answer, or the error that says that there was none in time, once that is known of all.

    None shall be left for the next request to find. What is worse than silence is raised.
    """
    answers = await asyncio.gather(*asked, return_exceptions=True)
    told: list[Answer | Unanswered] = []
    for answer in answers:
        if isinstance(answer, BaseException) and not isinstance(answer, Unanswered):
            raise answer
        told.append(answer)
    return told


async def all_answers(asked: Iterable[Awaitable[Answer]]) -> list[Answer]:
    """Return all answers, once there are all; raise where one is missing."""
    answers: list[Answer] = []
    for answer in await answers_or_silence(asked):
        if isinstance(answer, Unanswered):
            raise answer
        answers.append(answer)
    return answers


def _lead(bounded: float, margin: float, first: Reading, other: Reading, rate_hz: float) -> int | None:
    """Return how many samples a drive is ahead, by its replies ``bounded`` give or take ``margin``; None if unclear."""
    by_clock = other.sequence - first.sequence - (other.time - first.time) * rate_hz
    if abs(by_clock - round(by_clock)) < SAME_TIME and abs(round(by_clock) - bounded) <= margin + 0.5:
        return round(by_clock)
    return round(bounded) if margin <= 0.5 else None
