"""The cycle that moves the leg: set-points out, samples in, and every drive disabled at its end whatever happens."""

import asyncio
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import ceil

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.columns import columns_of
from pipelines.acquisition.journal import Journal
from pipelines.acquisition.machine import Machine, Row
from pipelines.acquisition.pace import Lockstep, PhaseLock
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.safety import Limits, refuse_leap, stop
from pipelines.errors import DeviceError

REPORT_S = 0.1
RATE_SAMPLES = 50
RATE_TOLERANCE = 0.05
"""How far the devices' clock may be from the rate that was asked for, and after how many samples that is looked at."""
REST_RAD = 0.02
"""How far the leg may have moved between the plan and the moment at which the drives are enabled."""


@dataclass(frozen=True)
class Progress:
    """What an operator wants to see."""

    state: str = "connecting"
    time_s: float = 0.0
    """Since the recording began; negative on the way there."""
    duration_s: float = 0.0
    row: Row | None = None
    samples: int = 0
    missed: int = 0
    rate_hz: float = 0.0
    """Samples a second of wall time."""


Report = Callable[[Progress], None]


@dataclass
class Loop:
    """One run while it goes on."""

    machine: Machine
    plan: Plan
    journal: Journal
    rate: float
    report: Report
    stopped_by: Sequence[str]
    """Names of the signals that have come."""
    sent: NDArray
    """(J,) last set-point, rad; to begin with, where the leg stands."""
    gaps: list[tuple[float, int]] = field(default_factory=list)
    """First missing time and number of missing samples, within the recording."""

    def __post_init__(self) -> None:
        self._speed = np.zeros_like(self.sent)
        self._sent_at = time.monotonic()
        self._limits = Limits(self.machine.rig, self.rate, [sensor.settings for sensor in self.machine.sensors])
        self._watchdog = self.machine.rig.safety.watchdog_s
        self._began: float | None = None
        self._columns = columns_of(self.machine)
        self._cycle = 0

    async def run(self) -> str | None:
        """Follow the plan to its end, then disable the drives; return why it was stopped early, None if it was not."""
        why = None
        try:
            await self._follow()
        except DeviceError as error:
            why = str(error)
        except Exception as error:  # what was recorded, and what the stop has to say, must not be lost
            why = f"a fault of exoid's own ({error!r}); please report it"
        finally:  # a fault of exoid's own must not leave a drive enabled either
            complaints = await self._stop()
        if complaints:
            why = f"{why or 'the run is complete'}; and could not be disabled: {'; '.join(complaints)}"
        return why

    def _pace(self) -> Lockstep | PhaseLock:
        if self.machine.rig.clock == "lockstep":
            return Lockstep()
        return PhaseLock(self.rate, self.machine.drives[0].count, self._watchdog)

    async def _follow(self) -> None:
        """Send set-point after set-point; raise DeviceError as soon as something is wrong."""
        pace, path = self._pace(), np.vstack([self.sent, self.plan.reference])
        await self._check_rest()
        first = last = await self._exchange(path[0], np.zeros_like(self.sent), 0)
        began = fresh = reported = time.monotonic()
        # What is sent while a sample is latched is reached at the end of the next one.
        while last.sequence - first.sequence < len(path):
            found = await pace.wait(last.sequence)
            if self.stopped_by:
                raise DeviceError(f"stopped by {self.stopped_by[0]}")
            self._watch(time.monotonic() - fresh, last.sequence, found)
            index = min(found - first.sequence, len(path) - 1)
            row = await self._exchange(path[index], (path[index] - path[index - 1]) * self.rate, found - last.sequence)
            now = time.monotonic()
            self._watch(now - fresh, last.sequence, row.sequence)
            if row.sequence == last.sequence:
                continue
            self._check_clock(last, row)
            if why := self._limits.violation(row):
                raise DeviceError(why)
            self._keep(row, row.sequence - first.sequence - 2, row.sequence - last.sequence - 1)
            if row.sequence - first.sequence >= RATE_SAMPLES:
                self._check_rate(first, row)
            fresh, last = now, row
            if now - reported >= REPORT_S:
                reported = now
                self._tell(row, row.sequence - first.sequence, now - began)

    async def _check_rest(self) -> None:
        """Refuse to enable drives whose leg no longer stands where the plan begins, or after a signal."""
        row = await self.machine.look()
        if self.stopped_by:
            raise DeviceError(f"stopped by {self.stopped_by[0]}")
        for drive, planned, found in zip(self.machine.rig.drive, self.sent, row.angle, strict=True):
            if not abs(found - planned) <= REST_RAD:
                raise DeviceError(
                    f"the {drive.joint} moved from {planned:.3f} to {found:.3f} rad before its drive was enabled; keep "
                    "the leg still and start again"
                )
        if why := self._limits.violation(row):
            raise DeviceError(why)

    async def _exchange(self, reference: NDArray, speed: NDArray, samples: int) -> Row:
        """Exchange all devices, ``samples`` after the last time.

        Remembers how the set-points move, in case they must be slowed down.
        """
        now, elapsed = time.monotonic(), samples / self.rate
        if self.machine.rig.clock == "real_time":  # a counter that leaps does not make time go by
            elapsed = min(elapsed, now - self._sent_at + 1.0 / self.rate)
        refuse_leap(self.machine.rig, self.sent, reference, elapsed)
        self.sent, self._speed, self._sent_at = reference, speed, now
        self._cycle += 1
        return await self.machine.cycle(reference, self._cycle)

    def _keep(self, row: Row, index: int, missed: int) -> None:
        """Write a sample that carries set-point ``index`` of the plan, and note those missed before it."""
        first, stop = self.plan.first, self.plan.stop
        missing = range(max(index - missed, first), min(index, stop))
        if missing:
            self.gaps.append(((missing.start - first) / self.rate, len(missing)))
        if not first <= index < stop:
            return
        if self._began is None:
            self._began = row.time - (index - first) / self.rate
        self.journal.append([row.time - self._began, *(value(row) for value in self._columns.values())])

    def _watch(self, waited: float, last: int, found: int) -> None:
        """Refuse to go on after too long a wait, or with a counter that runs backwards or leaps."""
        device = self.machine.drives[0].device.label
        if waited > self._watchdog:
            raise DeviceError(
                f"watchdog: no new sample from {device} for {waited:.3f} s, allowed are {self._watchdog:g} s; its "
                "counter stands still, or this computer is too busy"
            )
        if found < last:
            raise DeviceError(f"{device}: its sample counter went back from {last} to {found}; was it restarted?")
        most = 1 + ceil(self._watchdog * self.rate)
        if found > last + most:
            raise DeviceError(
                f"{device}: its sample counter leapt from {last} to {found}, expected at most {most} samples within "
                f"the watchdog's {self._watchdog:g} s; was it restarted?"
            )

    def _check_clock(self, last: Row, row: Row) -> None:
        """Refuse a device clock that does not go on with the samples."""
        if not row.time > last.time:
            raise DeviceError(
                f"{self.machine.drives[0].device.label}: its clock went from {last.time:.6f} to {row.time:.6f} s while "
                f"its counter went from {last.sequence} to {row.sequence}; was it restarted?"
            )

    def _check_rate(self, first: Row, row: Row) -> None:
        """Refuse a device clock that does not tell the sample rate; a wrong unit in the rig file shows here."""
        found = (row.sequence - first.sequence) / max(row.time - first.time, 1e-9)
        if not abs(found / self.rate - 1.0) <= RATE_TOLERANCE:
            raise DeviceError(
                f"{self.machine.drives[0].device.label}: samples {found:.4g} times a second by its own clock, expected "
                f"{self.rate:g}; correct acquire.sample_rate_hz, or the unit of time in the rig file"
            )

    def _tell(self, row: Row, samples: int, elapsed: float) -> None:
        since = (samples - 2 - self.plan.first) / self.rate
        duration = (self.plan.stop - self.plan.first) / self.rate
        state = "ramp" if since < 0 else "run" if since < duration else "ramp down"
        missed = sum(count for _, count in self.gaps)
        self.report(Progress(state, since, duration, row, self.journal.rows, missed, samples / elapsed))

    async def _stop(self) -> list[str]:
        """Bring every drive to rest and take its torque away; return what went wrong with that."""
        safety, told = self.machine.rig.safety, zip(self.machine.drives, self.sent, self._speed, strict=True)
        at_once = asyncio.Event()
        stops = [
            stop(drive, float(reference), float(speed), safety.deceleration_rad_s2, self.rate, at_once)
            for drive, reference, speed in told
            if drive.touched
        ]
        feeling = asyncio.create_task(self._feel(at_once))
        complaints = await asyncio.gather(*stops, return_exceptions=True)
        feeling.cancel()
        await asyncio.gather(feeling, return_exceptions=True)
        return [str(complaint) for complaint in complaints if complaint]

    async def _feel(self, at_once: asyncio.Event) -> None:
        """Watch the cuffs while the drives slow down: whoever is still pressed is not to be held there."""
        while not at_once.is_set():
            if self._limits.force_violation(await self.machine.felt(0)):
                at_once.set()
            await asyncio.sleep(1.0 / self.rate)
