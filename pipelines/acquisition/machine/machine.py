"""All drives and force sensors of a rig, which together deliver one row a cycle."""

import asyncio
import time
from collections.abc import Awaitable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine.counter_leads import find_leads
from pipelines.acquisition.machine.drive import Drive, Send
from pipelines.acquisition.machine.drive_protocol import (
    empty_recorder,
    is_driven,
    make_idle,
    refuse_other_rate,
    reset_fault,
)
from pipelines.acquisition.machine.force_sensor import Sensor
from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.acquisition.modbus.line import lines_of
from pipelines.acquisition.modbus.one_client import greet
from pipelines.errors import DeviceError, Unanswered
from pipelines.mechanics.motion import CUFFS
from pipelines.settings.rig import RigSettings

Answer = TypeVar("Answer")


class Machine:
    """All devices of a rig."""

    def __init__(self, rig: RigSettings, *, with_sensors: bool, samples_per_cycle: int = 1) -> None:
        """Create the devices of a rig, with so many samples from one set-point to the next."""
        self.rig = rig
        line_of = lines_of(rig)
        self.drives = [
            Drive(rig, settings, line_of(settings), samples_per_cycle) for settings in rig.drive
        ]
        sensors = rig.sensor if with_sensors else ()
        self.sensors = [Sensor(rig, settings, line_of(settings)) for settings in sensors]
        self.samples_per_cycle = samples_per_cycle
        self.latches = rig.sampling == "cyclic" and rig.clocks == "common"
        """Whether a cycle brings one sample that all drives latched at the same instant."""
        self._parts: list[Drive | Sensor] = [*self.drives, *self.sensors]
        self.no_force = np.full((len(CUFFS), 3), np.nan)
        self.leads = [0 for _ in self.drives]
        """Samples by which each drive's counter is ahead of the first one's."""
        self.leads_are_vague = False
        """Whether the lines are too slow to determine the leads."""
        self._last_count = 0
        """Count of all drives at the end of the last cycle."""

    async def connect(self) -> None:
        """Open every line and check the identity of every device."""
        for k, part in enumerate(self._parts):
            earlier = [other.device for other in self._parts[:k]]
            identity, block = part.map.identity, part.map.read
            await greet(part.device, earlier, partial(part.device.read_anything, identity, block))
            await part.device.check_identity(identity, part.reader.function)

    async def refuse_driven(self) -> None:
        """Refuse to write to a rig that another program drives.

        Raises
        ------
        DeviceError
            Names the drives.
        """
        driven = await all_answers(is_driven(drive) for drive in self.drives)
        labels = [
            drive.device.label for drive, is_so in zip(self.drives, driven, strict=True) if is_so
        ]
        if labels:
            raise DeviceError(
                f"{' and '.join(labels)}: driven by another program, as angle or set-point change;"
                " end that program, or hold the leg still; nothing was sent"
            )

    async def reset_faults(self) -> None:
        """Clear the faults that drives report."""
        for drive in self.drives:
            await reset_fault(drive)

    async def make_idle(self) -> None:
        """Disable every drive before a run; refuse to go on where one was enabled.

        Raises
        ------
        DeviceError
            Names the drives that were enabled, since an unknown program may have moved the leg.
        """
        # All are disabled before one of them is complained of.
        enabled = [drive.device.label for drive in self.drives if await make_idle(drive)]
        if enabled:
            raise DeviceError(
                f"{' and '.join(enabled)}: enabled before the run began, perhaps by one that was"
                " killed; disabled now; check the leg and what else moves it, then start again"
            )

    async def refuse_other_rate(self, cycle_hz: float) -> None:
        """Refuse drives that do not sample at the rate of the run; in lockstep all do.

        Raises
        ------
        DeviceError
            Names a drive and its rate.
        """
        if self.rig.clock == "lockstep":
            return
        is_recorded = self.rig.sampling == "recorder"
        setting = "record_rate_hz in the rig file" if is_recorded else "acquire.sample_rate_hz"
        rate_hz = cycle_hz * self.samples_per_cycle
        await all_answers(refuse_other_rate(drive, rate_hz, setting) for drive in self.drives)

    async def empty_records(self) -> None:
        """Discard the drives' samples from before the run."""
        await all_answers(empty_recorder(drive) for drive in self.drives)

    async def forget_records(self) -> None:
        """Discard recorded samples, at most one drain of each drive; the rest waits."""
        with suppress(Unanswered):
            await all_answers(drive.forget_records() for drive in self.drives)

    def close(self) -> None:
        """Close every line."""
        for part in self._parts:
            part.device.line.close()

    async def look(self) -> Row:
        """Read every device without moving anything, and determine the drives' leads.

        Raises
        ------
        DeviceError
            A drive reports a fault.
        """
        # Several times: between two requests a drive may go on to its next sample.
        looks = [await asyncio.gather(*(drive.look() for drive in self.drives)) for _ in range(9)]
        for reading in looks[-1]:
            if reading.fault:
                raise DeviceError(reading.fault)
        ahead = np.array(
            [[reading.sequence - look[0].sequence for reading in look] for look in looks]
        )
        self.leads = np.median(ahead, axis=0).astype(int).tolist()
        rig = self.rig
        # Records are matched by their numbers alone, so these leads must be exact.
        if rig.sampling == "recorder" and rig.clock == "real_time" and rig.clocks == "common":
            assert rig.record_rate_hz  # the rig file is checked: recorders have a rate
            leads = await find_leads(self.drives, rig.record_rate_hz)
            self.leads_are_vague = None in leads
            self.leads = [lead or 0 for lead in leads]
        self._last_count = looks[-1][0].sequence
        return Row(tuple(looks[-1]), await self.cuff_forces(), self.samples_per_cycle)

    async def count(self) -> int:
        """Return the cycle that the first drive is in."""
        return await self.drives[0].count() // self.samples_per_cycle

    async def cycle(self, number: int, send: Send) -> Answers:
        """Send to all drives at once; return the answers, and their common sample if latched.

        In lockstep the exchange with the drives ends a sample, so sensors are read before it. In
        real time the drives report when a new sample begins, so sensors are read after it. Nothing
        is sent twice, since a set-point that comes late is wrong by then.

        Parameters
        ----------
        number : int
            Number of the cycle, by which sensors take turns.
        send : callable
            Send one drive its set-point, and return its reading.

        Returns
        -------
        Answers
            ``row`` is None where an answer is missing.
        """
        if self.rig.clock == "lockstep":
            forces = await self.cuff_forces(number)
            answers = await _answers_or_timeouts(map(send, self.drives))
        else:
            answers = await _answers_or_timeouts(map(send, self.drives))
            forces = await self.cuff_forces(number)
        readings = [answer for answer in answers if isinstance(answer, Reading)]
        is_whole = len(readings) == len(answers)
        if is_whole and self.latches:
            is_whole = await self._latch(readings)
            answers = list(readings)
        row = Row(tuple(readings), forces, self.samples_per_cycle) if is_whole else None
        return Answers(tuple(answers), forces, row)

    async def cuff_forces(self, cycle: int | None = None) -> NDArray:
        """Read the sensors that are due in a cycle, or all of them without one.

        Returns
        -------
        (4, 3) array
            Force on each cuff, N; NaN where no sensor was read or had a new sample.
        """
        due = [sensor for sensor in self.sensors if cycle is None or sensor.is_due(cycle)]
        if not due:
            return self.no_force
        return self.by_cuff(due, await all_answers(sensor.look() for sensor in due))

    def by_cuff(
        self, sensors: Sequence[Sensor], answers: Sequence[tuple[float, float, float] | None]
    ) -> NDArray:
        """Return the answers of some sensors as forces on the cuffs, (4, 3) N; NaN without one."""
        forces = self.no_force.copy()
        # In the order of the recording's columns, not of the rig file.
        for sensor, force in zip(sensors, answers, strict=True):
            if force is not None:
                forces[CUFFS.index(sensor.settings.cuff)] = force
        return forces

    async def _latch(self, readings: list[Reading]) -> bool:
        """Read drives again until all have latched the newest sample; return False if not."""
        # Pause before a drive is read again that has not latched the cycle's sample yet.
        lag_pause_s = 0.0002
        until = time.monotonic() + self.rig.safety.watchdog_s
        while True:
            # Without the leads, counters that were started apart would never agree.
            counts = [
                reading.sequence - lead for reading, lead in zip(readings, self.leads, strict=True)
            ]
            late = [j for j, count in enumerate(counts) if count < max(counts)]
            if not late:
                self._last_count = max(counts)
                return True
            if time.monotonic() > until:
                raise DeviceError(self._out_of_step(readings, counts))
            await asyncio.sleep(lag_pause_s)
            for j in late:
                # Read only, not sent again: by then another set-point is due.
                try:
                    readings[j] = await self.drives[j].look(in_motion=True)
                except Unanswered:
                    return False

    def _out_of_step(self, readings: Sequence[Reading], counts: Sequence[int]) -> str:
        """Return in words which drive's counter differs from the others', and how."""
        slow, fast = int(np.argmin(counts)), int(np.argmax(counts))
        gained = [count - self._last_count for count in counts]
        # The counter that goes on as before is right.
        j, other = (fast, slow) if gained[slow] > 0 else (slow, fast)
        change = (
            "leapt" if gained[slow] > 0 else "went back" if gained[slow] < 0 else "stands still"
        )
        return (
            f"{self.drives[j].device.label}: its sample counter {change}"
            f" ({readings[j].sequence - gained[j]}, then {readings[j].sequence}) while that of"
            f" drive {self.rig.drive[other].joint} went on by {gained[other]} in"
            f' {self.rig.safety.watchdog_s:g} s; was it restarted? Or set clocks = "own" in the'
            " rig file, if each drive has a clock of its own"
        )


async def _answers_or_timeouts(requests: Iterable[Awaitable[Answer]]) -> list[Answer | Unanswered]:
    """Wait for all requests; return each answer, or the error of one that came too late.

    Any other error is raised.
    """
    # All are awaited, so that no late answer is taken for that of a later request.
    answers = await asyncio.gather(*requests, return_exceptions=True)
    results: list[Answer | Unanswered] = []
    for answer in answers:
        if isinstance(answer, BaseException) and not isinstance(answer, Unanswered):
            raise answer
        results.append(answer)
    return results


async def all_answers(requests: Iterable[Awaitable[Answer]]) -> list[Answer]:
    """Wait for all requests and return their answers.

    Parameters
    ----------
    requests : iterable of awaitable
        They run concurrently.

    Returns
    -------
    list
        In the order of the requests.

    Raises
    ------
    Unanswered
        An answer is missing.
    """
    answers: list[Answer] = []
    for answer in await _answers_or_timeouts(requests):
        if isinstance(answer, Unanswered):
            raise answer
        answers.append(answer)
    return answers
