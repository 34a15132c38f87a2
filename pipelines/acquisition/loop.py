"""The cycle that moves the leg: set-points out, samples in, and every drive disabled at its end whatever happens."""

import asyncio
import time
from collections.abc import Callable, Coroutine, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from pipelines.acquisition.columns import columns_of
from pipelines.acquisition.journal import Journal
from pipelines.acquisition.latency import Latencies
from pipelines.acquisition.machine import Answers, Machine, Row, all_answers
from pipelines.acquisition.pace import Lockstep, PhaseLock
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.sampling import Sampling
from pipelines.acquisition.states import State, Supervisor
from pipelines.errors import DeviceError, Unanswered

REPORT_S = 0.1
DISABLE_TRIES = 3
"""How often a drive is told to disable, each time but the first on a new connection."""


@dataclass(frozen=True)
class Progress:
    """What an operator wants to see."""

    state: State = State.IDLE
    time_s: float = 0.0
    """Since the recording began; negative on the way there."""
    duration_s: float = 0.0
    row: Row | None = None
    samples: int = 0
    missed: int = 0
    gaps: int = 0
    """In how many places samples were missed."""
    rate_hz: float = 0.0
    """Samples a second of wall time."""
    abort: str | None = None
    """Why the run is being stopped early."""
    still_enabled: bool = False
    """Whether a drive may still move the leg though it was told to disable."""


Report = Callable[[Progress], None]


@dataclass
class Loop:
    """One run while it goes on: carries out what the supervisor decides."""

    machine: Machine
    supervisor: Supervisor
    sampling: Sampling
    plan: Plan
    journal: Journal
    report: Report
    stopped_by: Sequence[str]
    """Names of the signals that have come."""
    gaps: list[tuple[float, int]] = field(default_factory=list)
    """First missing time and number of missing samples, within the recording."""

    def __post_init__(self) -> None:
        self._rate = self.supervisor.rate
        self._samples_hz = self._rate * self.machine.samples_per_cycle
        self._next = 0
        """Sample of the recording that is to come next."""
        self._recording_began: float | None = None
        self._columns = columns_of(self.machine)
        self._latencies = Latencies()
        self._cycle = 0
        self._row: Row | None = None
        self._enabled_at = self._reported = 0.0

    async def run(self) -> None:
        """Follow the plan to its end, then disable the drives; the supervisor knows why that came early."""
        try:
            await self._follow()
        except BaseException as error:  # whatever it is: the drives come first, it is told after them
            self.supervisor.abort(error)
        await self._stop()

    def found(self) -> dict[str, Any]:
        """Return what the run found out for the recording's metadata."""
        clocks, latency = self.sampling.clocks(self._recording_began or 0.0), self._latencies.metadata()
        return ({"clocks": clocks} if clocks else {}) | ({"latency": latency} if latency else {})

    def _pace(self) -> Lockstep | PhaseLock:
        rig = self.machine.rig
        if rig.clock == "lockstep":
            return Lockstep(self.machine.count)
        return PhaseLock(self._rate, self.machine.count, rig.safety.watchdog_s)

    async def _follow(self) -> None:
        """Send set-point after set-point; raise as soon as something is wrong."""
        pace = self._pace()
        self.supervisor.check_rest(await self.machine.look())
        last = await self._enable()
        while not self.supervisor.has_followed(last):
            found = await pace.wait(last.sequence)
            self._heed_signals()
            if self.supervisor.missed(found, time.monotonic()) and not await self._resume():
                continue
            answers = await self._exchange(self.supervisor.next(found, time.monotonic()))
            row = self.supervisor.judge(answers, time.monotonic())
            if row is None:
                continue
            last = self._row = row
            for whole in await self.sampling.rows(row):
                self._keep(whole)
            if time.monotonic() - self._reported >= REPORT_S:
                self._tell()

    async def _resume(self) -> bool:
        """Ask the drives what they made of a silence; tell whether they answered."""
        try:
            readings = await all_answers(drive.look(in_motion=True) for drive in self.machine.drives)
        except Unanswered:
            return False
        for joint, reading in enumerate(readings):
            self.supervisor.resume(joint, reading, time.monotonic() - self.supervisor.sent_at)
        return True

    async def _enable(self) -> Row:
        """Enable the drives where the leg stands; return the first sample at which they say that they are."""
        began = time.monotonic()
        while True:
            self._heed_signals()
            answers = await self._exchange(self.supervisor.rest(time.monotonic()))
            if row := self.supervisor.enabled(answers, time.monotonic() - began):
                break
            await asyncio.sleep(1.0 / self._rate)
        self._enabled_at = self._reported = time.monotonic()
        self.supervisor.begin(row, self._enabled_at)
        return row

    def _heed_signals(self) -> None:
        if self.stopped_by:
            raise DeviceError(f"stopped by {self.stopped_by[0]}")

    async def _exchange(self, reference: NDArray) -> Answers:
        self._cycle += 1
        asked = time.perf_counter()
        answers = await self.machine.cycle(reference, self._cycle)
        self._latencies.add(time.perf_counter() - asked)
        return answers

    def _keep(self, row: Row) -> None:
        """Write a sample, and note those missed before it."""
        sample, stop = self.supervisor.sample(row), (self.plan.stop - self.plan.first) * row.samples_per_cycle
        missing = range(self._next, min(sample, stop))
        if missing:
            self.gaps.append((missing.start / self._samples_hz, len(missing)))
        self._next = max(sample + 1, 0)
        if not 0 <= sample < stop:
            return
        if self._recording_began is None:
            self._recording_began = row.time - sample / self._samples_hz
        try:
            self.journal.append([row.time - self._recording_began, *(value(row) for value in self._columns.values())])
        except OSError as error:
            raise DeviceError(f"the journal cannot be written ({error})") from error

    def _tell(self) -> None:
        """Report how far the run is."""
        self._reported, row, duration = time.monotonic(), self._row, (self.plan.stop - self.plan.first) / self._rate
        state, why, enabled = self.supervisor.state, self.supervisor.why, self.supervisor.still_enabled
        if row is None:
            self.report(Progress(state, duration_s=duration, abort=why, still_enabled=enabled))
            return
        index = self.supervisor.index(row)
        self.report(
            Progress(
                state,
                time_s=(index - self.plan.first) / self._rate,
                duration_s=duration,
                row=row,
                samples=self.journal.rows,
                missed=sum(count for _, count in self.gaps),
                gaps=len(self.gaps),
                rate_hz=(index + 2) * row.samples_per_cycle / (self._reported - self._enabled_at),
                abort=why,
                still_enabled=enabled,
            )
        )

    async def _stop(self) -> None:
        """Bring every drive to rest and take its torque away, whatever happens meanwhile."""
        touched = [j for j, drive in enumerate(self.machine.drives) if drive.told_reference is not None]
        stops = [asyncio.ensure_future(self._stop_drive(j)) for j in touched]
        feeling = asyncio.ensure_future(self._feel())
        self._tell_stop()
        await _outlive(stops, self.supervisor.abort)
        feeling.cancel()
        await _outlive([feeling], self.supervisor.abort)
        # One that was cancelled before it began has told its drive nothing.
        complaints = [
            await self._disable(j) if stop.cancelled() else stop.result()
            for j, stop in zip(touched, stops, strict=True)
        ]
        self.supervisor.finish(list(dict.fromkeys(filter(None, complaints))))  # a lost line is one complaint
        self._tell_stop()

    def _tell_stop(self) -> None:
        """Report, but let nothing that goes wrong with that stand in the way of stopping."""
        try:
            self._tell()
        except BaseException as error:
            self.supervisor.abort(error)

    async def _stop_drive(self, joint: int) -> str | None:
        """Slow one drive down and disable it, whatever happens to the others; return why it could not be disabled."""
        drive, period = self.machine.drives[joint], 1.0 / self._rate
        told, answered = self.supervisor.sent_at, time.monotonic()
        if drive.told_reference is not None:  # what was decided last may not have been sent
            self.supervisor.begin_stop(joint, drive.told_reference)
        stopping = self.supervisor.stopping(joint)
        try:
            if drive.latest is not None:  # it came beside what ended the run, perhaps, and nobody has judged it
                self.supervisor.heed(joint, drive.latest)
            while True:
                # On the host's clock: the device's counter may be what has failed. What is late is not caught up
                # with, so that set-points never come faster than samples.
                await asyncio.sleep(0.0 if drive.in_lockstep else max(0.0, told + period - time.monotonic()))
                try:
                    if self.supervisor.is_stale(told, time.monotonic()):
                        reading = await drive.look(in_motion=True)
                        self.supervisor.resume(joint, reading, time.monotonic() - told)
                    if not (due := next(stopping, ())):
                        break
                    (reference, halt), told = due, time.monotonic()
                    self.supervisor.feel(joint, await drive.exchange(reference, halt=halt))
                    answered = time.monotonic()
                except Unanswered:  # a lost reply alone is no reason to take a moving leg's torque away
                    if time.monotonic() - answered > self.machine.rig.safety.watchdog_s:
                        raise
        except BaseException as error:  # whatever it is, the drive may still hear that it shall disable
            self.supervisor.abort(error)
        return await self._disable(joint)

    async def _disable(self, joint: int) -> str | None:
        """Take a drive's torque away; return why that could not be done."""
        drive, complaint = self.machine.drives[joint], ""
        for attempt in range(DISABLE_TRIES):
            try:
                if attempt:
                    await drive.device.line.renew()
                await drive.disable(float(self.supervisor.sent[joint]))
                return None
            except DeviceError as error:
                complaint = str(error)
            except BaseException as error:  # one drive's failure must not hide another's
                complaint = f"{drive.device.label}: {error!r}"
        return complaint

    async def _feel(self) -> None:
        """Watch the cuffs while the drives slow down: whoever is still pressed is not to be held there."""
        try:
            while not self.supervisor.pressing:
                self.supervisor.feel_cuffs(await self.machine.felt(0))
                await asyncio.sleep(1.0 / self._rate)
        except asyncio.CancelledError:  # the drives are disabled
            pass
        except BaseException as error:
            self.supervisor.abort(error)


def run_to_its_end(run: Coroutine, note: Callable[[BaseException], None]) -> None:
    """Run a coroutine to its end in an event loop of its own, and whatever it raises there.

    An exception that ends the loop itself, as KeyboardInterrupt does, is noted, and the loop goes on: the coroutine
    has drives to disable.
    """
    with asyncio.Runner() as runner:
        loop = runner.get_loop()
        task = loop.create_task(run)
        while True:
            try:
                return loop.run_until_complete(task)
            except BaseException as error:
                if task.done():
                    raise
                note(error)


async def _outlive(tasks: Iterable[asyncio.Future], note: Callable[[BaseException], None]) -> None:
    """Wait until all tasks have ended; what asks this one to end meanwhile is noted, and does not end them."""
    pending = set(tasks)
    while pending:
        try:
            _, pending = await asyncio.wait(pending)
        except BaseException as error:
            note(error)
