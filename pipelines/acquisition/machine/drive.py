"""One drive: set-points out, readings in."""

import time
from collections.abc import Awaitable, Callable, Mapping
from math import isfinite, nan

from pipelines.acquisition.machine.clock_offset import Bounds
from pipelines.acquisition.machine.reading import DriveStatus, Reading
from pipelines.acquisition.modbus.blocks import BlockReader, BlockWriter
from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.modbus.ring_buffer import Queue, Ring
from pipelines.acquisition.modbus.wraparound import Unwrapper
from pipelines.errors import DeviceError, Refused, Unanswered
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.devices import DriveSettings


class Drive:
    """One drive: set-points out, readings in."""

    def __init__(
        self, rig: RigSettings, settings: DriveSettings, line: Line, samples_per_cycle: int = 1
    ) -> None:
        self.settings = settings
        self.in_lockstep = rig.clock == "lockstep"
        self.control_s = rig.safety.control_s
        self.map = rig.map.drive[settings.map]
        self.device = Device(f"drive {settings.joint}", settings.unit, line, rig.safety)
        self.reader = BlockReader(self.device, self.map.read)
        self.read_block = self.reader.block
        self._writer = BlockWriter(self.device, self.map.write)
        self.write_block = Block(registers_of(self.map.write))
        self._counter_block = Block({"sequence": self.map.read.sequence})
        # Of a drive without a status word it is never read: every mask needs the register.
        self._status_block = Block({"status": self.map.read.status or self.map.read.sequence})
        self._heartbeat = 0
        has_heartbeat = self.map.write.heartbeat is not None
        self._heartbeat_modulus = int(self.write_block.modulus("heartbeat")) if has_heartbeat else 1
        self._unwrap_sequence = Unwrapper(self.read_block.modulus("sequence"))
        self._unwrap_time = Unwrapper(self.read_block.modulus("time"))
        self.bounds: Bounds | None = None
        """Updated with every reply, where the drive's sampling instants are of interest."""
        self.ring = self._make_ring(samples_per_cycle) if rig.sampling == "recorder" else None
        self.recorded = self._recorded_quantities()
        """Quantities of the samples that a recording keeps."""
        self._temperature = nan
        self._sent = nan
        self._newest_sequence = 0
        self.was_sent = False
        """Whether any set-point was on its way to the drive; else it need not be disabled."""
        self.answered_at = 0.0
        """Host's clock, s, when it answered the last set-point."""
        self.statuses: list[DriveStatus] = []
        """Reported statuses that were not passed on yet, as a request may have been cancelled."""

    def _make_ring(self, samples_per_cycle: int) -> Ring | Queue:
        settings = self.map.ring
        assert settings  # the rig file is checked: with recorders, every drive has one
        self._unwrap_ring_time = Unwrapper(Block(registers_of(settings.record)).modulus("time"))
        if settings.fifo is not None:
            return Queue(self.device, settings, samples_per_cycle)
        return Ring(self.device, settings, self._note_newest, samples_per_cycle)

    def _recorded_quantities(self) -> frozenset[str]:
        always = {"angle", "torque", "current"}
        reported = set(self.read_block.names)
        if self.ring is None or self.map.ring is None:
            return frozenset(always | reported | {"reference"})
        ring = set(registers_of(self.map.ring.record))
        return frozenset(always | ring | ({"temperature"} & reported))

    async def look(self, *, in_motion: bool = False) -> Reading:
        """Read the drive without writing to it.

        Parameters
        ----------
        in_motion : bool, optional
            Whether to use the short time-out of a moving leg.

        Returns
        -------
        Reading
            SI units.

        Raises
        ------
        DeviceError
            No answer came in time, or the drive refused.
        """
        asked = time.perf_counter()
        return self._reading(await self.reader.read(in_motion=in_motion), asked)

    async def read_values(self) -> Mapping[str, float]:
        """Read all quantities outside any exchange, SI units."""
        values = self.read_block.decode(await self.reader.read())
        self._refuse_not_finite(values)
        return values

    async def read_status(self) -> int:
        """Read the status word alone."""
        # With a short time-out: other drives on the line may still be moving.
        return int((await self._read(self._status_block, in_motion=True))["status"])

    async def count(self) -> int:
        """Read the sample counter alone; return the last known count where there is no answer."""
        asked = time.perf_counter()
        try:
            values = await self._read(self._counter_block, in_motion=True)
        except Unanswered:
            # As if no new sample had come: pacing waits on, until the watchdog expires.
            return self._newest_sequence
        return self._note_newest(values["sequence"], asked)

    async def drain(self, newest: int) -> list[Reading]:
        """Return new samples of the drive's own record.

        Parameters
        ----------
        newest : int
            Number of the newest sample.

        Returns
        -------
        list of Reading
            Oldest first.

        Raises
        ------
        DeviceError
            No answer came in time, or the drive refused.
        """
        assert self.ring  # only drives with recorders are drained
        return [self._of_ring(number, record) for number, record in await self.ring.drain(newest)]

    async def forget_records(self) -> bool:
        """Discard recorded samples, at most one drain's; return whether none is left."""
        return self.ring is None or await self.ring.forget()

    async def exchange(self, reference: float, *, halt: bool = False) -> Reading:
        """Send a set-point and return the latched sample.

        Parameters
        ----------
        reference : float
            Set-point, rad.
        halt : bool, optional
            Whether to send the halt word.

        Returns
        -------
        Reading
            SI units.

        Raises
        ------
        DeviceError
            No answer came in time, or the drive refused.
        """
        control = self.map.enable if self.map.halt is None or not halt else self.map.halt
        words = self.words(control, reference)
        self.was_sent = True
        # Without an answer it is unknown which set-point the drive follows.
        before, self._sent = self._sent, nan
        asked = time.perf_counter()
        if self._writer.exchanges:
            answer = await self.device.exchange(self.write_block, words, self.read_block)
        else:
            await self._writer.write(words, control_first=False, in_motion=True)
            asked = time.perf_counter()
            answer = await self.reader.read(in_motion=True)
        # The sample was latched before the new set-point took effect, so it carries the one before.
        self._sent, self.answered_at = before, time.monotonic()
        reading = self._reading(answer, asked)
        self._sent = reference
        return reading

    async def write_idle(self, control: int, angle: float, *, in_motion: bool = False) -> None:
        """Write a control word to a drive that shall not follow.

        Parameters
        ----------
        control : int
            The control word.
        angle : float
            Where its leg is, rad.
        in_motion : bool, optional
            Whether to use the short time-out of a moving leg.

        Raises
        ------
        DeviceError
            No answer came in time, or the drive refused.
        """
        words = await self.idle_words(control, angle)
        await self._writer.write(words, control_first=True, in_motion=in_motion)

    def words(self, control: int, reference: float) -> list[int]:
        """Return the registers of a control word and a set-point (rad).

        Raises
        ------
        DeviceError
            The set-point is not a number, or outside the joint's limits.
        """
        low, high = self.settings.angle_rad
        if not low <= reference <= high:
            raise DeviceError(
                f"{self.device.label}: a set-point of {reference:.3f} rad was due, outside its"
                f" limits {low:g} to {high:g} rad; it was not sent"
            )
        # Rounding to a register's count must not lead beyond a limit either.
        half = self.map.write.reference.step / 2.0
        return self._encode(control, min(max(reference, low + half), high - half))

    async def idle_words(self, control: int, angle: float) -> list[int]:
        """Return the registers of a control word for a drive that shall not follow.

        Where the leg is outside its limits, the set-point is the one that the drive holds; the
        nearest limit if its registers cannot be read.

        Parameters
        ----------
        control : int
            The control word.
        angle : float
            Where its leg is, rad.

        Returns
        -------
        list of int
            Words of the write block.
        """
        low, high = self.settings.angle_rad
        if low <= angle <= high:
            return self.words(control, angle)
        block = self.write_block
        try:
            held = block.decode(await self.device.read(block.address, block.count))["reference"]
        except Refused:  # not every drive lets its written registers be read
            held = min(max(low, angle if isfinite(angle) else 0.0), high)
        return self._encode(control, held)

    def says_enabled(self, status: int) -> bool:
        """Return whether a status word reports that the drive is enabled."""
        return status & self.map.enabled_mask == self.map.enabled_value

    def _note_newest(self, sequence: float, asked: float | None) -> int:
        """Return the sample number of a reply; it was the newest when ``asked`` (s) is given."""
        number = int(self._unwrap_sequence(sequence))
        if asked is not None:
            if self.bounds:
                self.bounds.add(number, asked, time.perf_counter())
            self._newest_sequence = number
        return number

    def _encode(self, control: int, reference: float) -> list[int]:
        # A drive with such a register counts only a changed value as a sign of life.
        self._heartbeat = (self._heartbeat + 1) % self._heartbeat_modulus
        return self.write_block.encode(
            {"reference": reference, "control": control, "heartbeat": self._heartbeat}
        )

    async def _read(self, block: Block, *, in_motion: bool) -> Mapping[str, float]:
        words = await self.device.read(
            block.address, block.count, function=self.reader.function, in_motion=in_motion
        )
        values = block.decode(words)
        self._refuse_not_finite(values)
        return values

    def _refuse_not_finite(self, values: Mapping[str, float]) -> None:
        # Quantities that must be finite: NaN would mean that the drive does not report them.
        must_be_finite = ("sequence", "time", "status", "velocity", "temperature", "reference")
        for name in must_be_finite:
            if not isfinite(values.get(name, 0.0)):
                raise DeviceError(
                    f"{self.device.label}: its {name} is {values[name]}, expected a number; compare"
                    " the register map in the rig file with the device's manual"
                )

    def _reading(self, words: list[int], asked: float) -> Reading:
        values = self.read_block.decode(words)
        status = self._status(values.get("status", 0.0))
        # Before the other values are checked: a fault counts whatever they are.
        self.statuses.append(status)
        self._refuse_not_finite(values)
        self._temperature = values.get("temperature", nan)
        number = self._note_newest(values["sequence"], asked)
        return self._sample(number, self._unwrap_time(values["time"]), values, self._sent, status)

    def _status(self, word: float) -> DriveStatus:
        """Return the meaning of a status word; without content where it is not a number."""
        if not isfinite(word):
            return DriveStatus()
        enabled = self.says_enabled(int(word)) if self.map.enabled_mask else None
        return DriveStatus(enabled=enabled, fault=self._fault(int(word)))

    def _fault(self, status: int) -> str | None:
        """Return the fault of a status word in words; None where it has none."""
        bits = self.map.active_faults(status)
        if not bits:
            return None
        reset = ""
        if self.map.fault_reset is not None:
            reset = ", with --reset-faults where the drive is to clear it"
        return (
            f"{self.device.label}: reports a fault (status bits {bits}); see the drive's manual, "
            f"clear the fault and start again{reset}"
        )

    def _of_ring(self, number: int, values: Mapping[str, float]) -> Reading:
        """Return a record as a sample; its temperature is that of the last exchange."""
        self._refuse_not_finite(values)
        time_s = self._unwrap_ring_time(values["time"])
        return self._sample(number, time_s, values, nan, DriveStatus())

    def _sample(
        self,
        number: int,
        time_s: float,
        values: Mapping[str, float],
        sent: float,
        status: DriveStatus,
    ) -> Reading:
        """Return values as a sample; ``sent`` is the set-point (rad) of a drive without its own."""
        return Reading(
            sequence=number,
            time=time_s,
            angle=values["angle"],
            torque=values["current"] * self.settings.torque_per_ampere,
            current=values["current"],
            velocity=values.get("velocity", nan),
            temperature=self._temperature,
            reference=values.get("reference", sent),
            **vars(status),
        )


Send = Callable[[Drive], Awaitable[Reading]]
"""Sends a drive its set-point and returns the sample that is latched."""
