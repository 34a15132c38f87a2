"""The rig as acquisition sees it: drives and force sensors that together deliver one row a
cycle."""

import asyncio
import time
from collections.abc import Awaitable, Iterable, Sequence
from contextlib import suppress
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine.clock_offset import Bounds
from pipelines.acquisition.machine.drive import Drive, Reading, Send
from pipelines.acquisition.machine.force_sensor import Sensor
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.acquisition.modbus.line import lines_of
from pipelines.errors import DeviceError, Unanswered
from pipelines.mechanics.motion import CUFFS
from pipelines.settings.rig import RigSettings

LAG_PAUSE_S = 0.0002
"""Before a drive is asked again that has not latched its sample yet."""

LOOKS = 9
"""Readings from which the distance between the drives' counters is taken."""
SAME_TIME = 0.1
"""Share of a sample within which the clocks of drives that sample together tell the same time."""
MOST_LOOKS = 200
"""How many it may take where samples come faster than replies."""

Answer = TypeVar("Answer")


class Machine:
    """All devices of a rig."""

    def __init__(self, rig: RigSettings, *, with_sensors: bool, samples_per_cycle: int = 1) -> None:
        """Take the devices of a rig; drives take so many samples from one set-point to the next."""
        self.rig = rig
        line_of = lines_of(rig)
        self.drives = [
            Drive(rig, settings, line_of(settings), samples_per_cycle) for settings in rig.drive
        ]
        self.sensors = (
            [Sensor(rig, settings, line_of(settings)) for settings in rig.sensor]
            if with_sensors
            else []
        )
        self.samples_per_cycle = samples_per_cycle
        self.latches = rig.sampling == "cyclic" and rig.clocks == "common"
        """Whether a cycle brings one sample that all drives latched at the same instant."""
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
        if labels := [
            drive.device.label for drive, is_so in zip(self.drives, driven, strict=True) if is_so
        ]:
            raise DeviceError(
                f"{' and '.join(labels)}: driven by somebody else, since angle or set-point change"
                " while exoid sends nothing; end the other program, or hold the leg still; nothing"
                " was sent"
            )

    async def reset_faults(self) -> None:
        """Clear the faults that drives report."""
        for drive in self.drives:
            await drive.reset_fault()

    async def make_idle(self) -> None:
        """Disable every drive before a run; refuse to go on where one was enabled: nobody knows
        what moved the leg."""
        enabled = [drive.device.label for drive in self.drives if await drive.make_idle()]
        if enabled:
            raise DeviceError(
                f"{' and '.join(enabled)}: enabled before the run began, by one that was killed"
                " perhaps; disabled now; see to the leg, and to what else moves it, and start"
                " again"
            )

    async def refuse_other_rate(self, cycle_hz: float) -> None:
        """Refuse drives that do not sample at the rate that is wanted; in lockstep each exchange is
        a sample."""
        if self.rig.clock == "lockstep":
            return
        setting = (
            "acquire.sample_rate_hz"
            if self.rig.sampling == "cyclic"
            else "record_rate_hz in the rig file"
        )
        rate_hz = cycle_hz * self.samples_per_cycle
        await all_answers(drive.refuse_other_rate(rate_hz, setting) for drive in self.drives)

    async def empty_records(self) -> None:
        """Let go what the drives' own records have kept so far: a queue that nobody read is full of
        what is past."""
        await all_answers(drive.empty_record() for drive in self.drives)

    async def forget_records(self) -> None:
        """Let go what has come to the drives' own records, without a pause for long; what is left
        waits."""
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
        looks = [
            await asyncio.gather(*(drive.look() for drive in self.drives)) for _ in range(LOOKS)
        ]
        for reading in looks[-1]:
            if reading.fault:
                raise DeviceError(reading.fault)
        ahead = np.array(
            [[reading.sequence - look[0].sequence for reading in look] for look in looks]
        )
        self.leads = np.median(ahead, axis=0).astype(int).tolist()
        if (
            self.rig.sampling == "recorder"
            and self.rig.clock == "real_time"
            and self.rig.clocks == "common"
        ):
            await self._find_leads()
        self._counted = looks[-1][0].sequence
        return Row(tuple(looks[-1]), await self.cuff_forces(), self.samples_per_cycle)

    async def _find_leads(self) -> None:
        """Find out how far the counters are apart though they go on while one drive after the other
        is asked.

        Replies bound it. Where the drives' clocks tell a distance within these bounds, they show
        the same time, and it is that; else the bounds must be narrow enough to leave one.
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
                        (origin - other[0]) * rate_hz,
                        (width + other[1]) * rate_hz / 2,
                        readings[0],
                        reading,
                        rate_hz,
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

    async def cycle(self, number: int, send: Send) -> Answers:
        """Send all drives at once; return what came: the sample that all devices latched, or of
        each its newest.

        In lockstep the drives' exchange ends a sample, so sensors are read before it. In real time
        the drives tell when a new sample begins, so sensors are read after it. Nothing is sent
        twice, for a set-point that comes late is no set-point.
        """
        if self.rig.clock == "lockstep":
            forces = await self.cuff_forces(number)
            answers = await answers_or_silence(map(send, self.drives))
        else:
            answers = await answers_or_silence(map(send, self.drives))
            forces = await self.cuff_forces(number)
        readings = [answer for answer in answers if isinstance(answer, Reading)]
        whole = len(readings) == len(answers)
        if whole and self.latches:
            whole = await self._latch(readings)
            answers = list(readings)
        row = Row(tuple(readings), forces, self.samples_per_cycle) if whole else None
        return Answers(tuple(answers), forces, row)

    async def cuff_forces(self, cycle: int | None = None) -> NDArray:
        """Return the forces (4, 3) N of those sensors that are due in a cycle, without one of
        all."""
        due = [sensor for sensor in self.sensors if cycle is None or sensor.is_due(cycle)]
        if not due:
            return self.no_force
        forces = self.no_force.copy()
        for sensor, force in zip(
            due, await all_answers(sensor.look() for sensor in due), strict=True
        ):
            if force is not None:
                forces[CUFFS.index(sensor.settings.cuff)] = force
        return forces

    async def _latch(self, readings: list[Reading]) -> bool:
        """Ask those drives again that have not latched the others' sample yet.

        Returns whether all have latched it in the end; not, where one does not answer.
        """
        until = time.monotonic() + self.rig.safety.watchdog_s
        while True:
            counts = [
                reading.sequence - ahead
                for reading, ahead in zip(readings, self.leads, strict=True)
            ]
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
            f"{self.drives[j].device.label}: its sample counter {what}"
            f" ({readings[j].sequence - gained[j]}, then "
            f"{readings[j].sequence}) while that of drive {self.rig.drive[other].joint} went on by"
            f" {gained[other]} in "
            f'{self.rig.safety.watchdog_s:g} s; was it restarted? Or set clocks = "own" in the rig'
            " file, if each drive "
            "has a clock of its own"
        )


async def answers_or_silence(asked: Iterable[Awaitable[Answer]]) -> list[Answer | Unanswered]:
    """Return each answer, or the error that says that there was none in time, once that is known of
    all.

    None shall be left for the next request to find. What is worse than silence is raised.
    """
    answers = await asyncio.gather(*asked, return_exceptions=True)
    results: list[Answer | Unanswered] = []
    for answer in answers:
        if isinstance(answer, BaseException) and not isinstance(answer, Unanswered):
            raise answer
        results.append(answer)
    return results


async def all_answers(asked: Iterable[Awaitable[Answer]]) -> list[Answer]:
    """Return all answers, once there are all; raise where one is missing."""
    answers: list[Answer] = []
    for answer in await answers_or_silence(asked):
        if isinstance(answer, Unanswered):
            raise answer
        answers.append(answer)
    return answers


def _lead(
    bounded: float, margin: float, first: Reading, other: Reading, rate_hz: float
) -> int | None:
    """Return how many samples a drive is ahead, by its replies ``bounded`` give or take ``margin``;
    None if unclear."""
    by_clock = other.sequence - first.sequence - (other.time - first.time) * rate_hz
    if (
        abs(by_clock - round(by_clock)) < SAME_TIME
        and abs(round(by_clock) - bounded) <= margin + 0.5
    ):
        return round(by_clock)
    return round(bounded) if margin <= 0.5 else None
