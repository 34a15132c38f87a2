"""The cycle that moves the leg: set-points out, samples in, and every drive disabled at its end
whatever happens."""

import asyncio
import time
from collections.abc import Callable, Coroutine, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from pipelines.acquisition.machine.drive import Drive, Reading
from pipelines.acquisition.machine.machine import Machine, all_answers
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.acquisition.machine.sampling import Sampling
from pipelines.acquisition.pacing import Lockstep, PhaseLock
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.recording.columns import columns_of
from pipelines.acquisition.recording.journal import Journal
from pipelines.acquisition.recording.latency_histogram import Latencies
from pipelines.acquisition.safety.supervisor import SLACK_SAMPLES, Supervisor
from pipelines.acquisition.states import State
from pipelines.errors import DeviceError, Unanswered
from pipelines.process.event_loop import exact_event_loop

REPORT_S = 0.1
DISABLE_TRIES = 3
"""How often a drive is told to disable, each time but the first on a new connection."""
MOST_ENDED = 1000
"""How often the event loop may be ended by what comes from outside until a run is given up."""
LOOK_PAUSE = 0.25
"""Share of a sample after which it is looked again whether a drive is told nothing."""


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
Decide = Callable[[int, float], float]
"""Decides which set-point (rad) a joint's drive is sent now, host's clock, s."""


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
        self._followed = asyncio.Event()
        """Set once the plan is followed no longer."""
        self._tending: list[asyncio.Future] = []
        self._moving = set[int]()
        """Drives that are being slowed down in the stop."""
        self._stopped = False
        """Whether all of them are disabled, or could not be."""

    async def run(self) -> None:
        """Follow the plan to its end, then disable the drives; the supervisor knows why that came
        early."""
        try:
            self.supervisor.check_rest(await self.machine.look())
            await self._tended(self._follow(await self._enable()))
        # Whatever it is: the drives come first, it is told after them.
        except BaseException as error:
            self.supervisor.abort(error)
        await self._stop()

    def found(self) -> dict[str, Any]:
        """Return what the run found out for the recording's metadata."""
        clocks, latency = (
            self.sampling.clocks(self._recording_began or 0.0),
            self._latencies.metadata(),
        )
        late = {"latency": latency | {"left_out": self.supervisor.left_out}} if latency else {}
        return ({"clocks": clocks} if clocks else {}) | late

    def _pace(self) -> Lockstep | PhaseLock:
        rig = self.machine.rig
        if rig.clock == "lockstep":
            return Lockstep(self.machine.count)
        return PhaseLock(self._rate, self.machine.count, rig.safety.watchdog_s)

    async def _tended(self, following: Coroutine) -> None:
        """Follow the plan, and tend every drive meanwhile, until one of these ends; the supervisor
        is told why."""
        follow = asyncio.ensure_future(following)
        # In lockstep no time passes while somebody is waited for.
        if self.machine.rig.clock == "real_time":
            self._tending = [
                asyncio.ensure_future(self._tend(joint))
                for joint in range(len(self.machine.drives))
            ]
        ended = set[asyncio.Future]()
        try:
            ended, _ = await asyncio.wait(
                [follow, *self._tending], return_when=asyncio.FIRST_COMPLETED
            )
        finally:
            self._followed.set()
            follow.cancel()
            self.sampling.end()
            await _outlive([follow], self.supervisor.abort)
            for task in ended:
                if error := asyncio.CancelledError() if task.cancelled() else task.exception():
                    self.supervisor.abort(error)

    async def _follow(self, last: Row) -> None:
        """Send set-point after set-point; raise as soon as something is wrong."""
        pace = self._pace()
        while not self.supervisor.has_followed(last):
            found = await pace.wait(last.sequence)
            self._heed_signals()
            found_at = time.monotonic()
            if self.supervisor.missed(found, found_at):
                try:
                    newest, found_at = await self._resume()
                except Unanswered:
                    continue
                found = max(found, newest)
            self.supervisor.next(found, found_at)
            answers = await self._exchange(self.supervisor.step)
            row = self.supervisor.judge(answers, time.monotonic())
            if row is None:
                continue
            last = self._row = row
            for whole in await self.sampling.rows(row):
                self._keep(whole)
            if time.monotonic() - self._reported >= REPORT_S:
                self._tell()

    async def _resume(self) -> tuple[int, float]:
        """Ask the drives what they made of a silence; return the cycle that the first one told, and
        when that was."""
        (first, told_at), *_ = await all_answers(
            self._find(joint) for joint in range(len(self.machine.drives))
        )
        return first.sequence // self.machine.samples_per_cycle, told_at

    async def _find(self, joint: int) -> tuple[Reading, float]:
        """Ask a drive where it is, to go on from there; return what it told, and when, host's
        clock, s."""
        told = self.supervisor.sent_at[joint]
        reading, now = await self.machine.drives[joint].look(in_motion=True), time.monotonic()
        if self.supervisor.sent_at[joint] == told:
            self.supervisor.resume(joint, reading, now)
        else:  # it was told something else meanwhile
            self.supervisor.heed(joint, reading)
        return reading, now

    async def _tend(self, joint: int) -> None:
        """Tell a drive where to go for as long as others are awaited, rather than nothing.

        Raise as soon as something is wrong, for whoever awaits does not hear of it.
        """
        drive, period = self.machine.drives[joint], 1.0 / self._rate
        patience, look_at = SLACK_SAMPLES * period, 0.0
        while True:
            told = self._told_at(joint)
            due = max(told + patience, look_at)
            with suppress(TimeoutError):
                async with asyncio.timeout(due - time.monotonic()):
                    await self._followed.wait()
                    return
            held_up = time.monotonic() - due > LOOK_PAUSE * period
            self._heed_signals()
            self.supervisor.refuse_after_abort()
            if self._told_at(joint) != told:  # nobody is awaited for long
                patience = SLACK_SAMPLES * period
            elif drive.device.awaited_s > period:  # it is the one who is awaited
                look_at = time.monotonic() + LOOK_PAUSE * period
            # By this computer, and so was whoever follows the plan: it goes first.
            elif held_up and due > look_at:
                look_at = time.monotonic() + period
            else:
                await self._tell_alone(joint)
                patience = period

    def _told_at(self, joint: int) -> float:
        """Return when a drive was told something last, or is being told."""
        return max(self.machine.drives[joint].told_at, float(self.supervisor.sent_at[joint]))

    async def _tell_alone(self, joint: int) -> None:
        """Tell one drive where to go, from where it is, unless it is told until its turn comes."""
        drive, told = self.machine.drives[joint], self.supervisor.sent_at[joint]
        with suppress(Unanswered):  # whoever follows the plan finds out for how long
            async with drive.device.turn():
                self._heed(joint)
                if self.supervisor.sent_at[joint] != told:
                    return
                if self.supervisor.is_stale(joint, time.monotonic()):
                    await self._find(joint)
                reading = await drive.exchange(self.supervisor.tend(joint, time.monotonic()))
                self.supervisor.hear(joint, time.monotonic())
                self.supervisor.judge_tended(joint, reading)

    async def _enable(self) -> Row:
        """Enable the drives where the leg stands; return the first sample at which they say that
        they are."""
        began = time.monotonic()
        while True:
            self._heed_signals()
            answers = await self._exchange(self.supervisor.rest)
            if row := self.supervisor.enabled(answers, time.monotonic() - began):
                break
            # Else what comes meanwhile would be in the way once the leg moves.
            await self.machine.forget_records()
            await asyncio.sleep(1.0 / self._rate)
        self._enabled_at = self._reported = time.monotonic()
        self.supervisor.begin(row, self._enabled_at)
        return row

    def _heed_signals(self) -> None:
        if self.stopped_by:
            raise DeviceError(f"stopped by {self.stopped_by[0]}")

    async def _exchange(self, decide: Decide) -> Answers:
        self._cycle += 1
        asked = time.perf_counter()
        answers = await self.machine.cycle(self._cycle, partial(self._tell_in_turn, decide))
        self._latencies.add(time.perf_counter() - asked)
        for joint, drive in enumerate(self.machine.drives):
            self.supervisor.hear(joint, drive.told_at)
            self._heed(joint)
        return answers

    async def _tell_in_turn(self, decide: Decide, drive: Drive) -> Reading:
        """Tell a drive its set-point, decided when its turn has come: by then it may have gone on
        by itself."""
        joint = self.machine.drives.index(drive)
        async with drive.device.turn():
            now = time.monotonic()
            if self.supervisor.is_stale(joint, now) or self.supervisor.is_late(now):
                await self._find(joint)
                decide = self.supervisor.tend
            return await drive.exchange(decide(joint, time.monotonic()))

    def _heed(self, joint: int) -> None:
        """Heed what a drive has told, though it came beside what is awaited, or ended the run, or
        was asked again."""
        conditions = self.machine.drives[joint].conditions
        while conditions:
            self.supervisor.heed(joint, conditions.pop(0))

    def _keep(self, row: Row) -> None:
        """Write a sample, and note those missed before it."""
        sample, stop = (
            self.supervisor.sample(row),
            (self.plan.stop - self.plan.first) * row.samples_per_cycle,
        )
        missing = range(self._next, min(sample, stop))
        if missing:
            self.gaps.append((missing.start / self._samples_hz, len(missing)))
        self._next = max(sample + 1, 0)
        if not 0 <= sample < stop:
            return
        if self._recording_began is None:
            self._recording_began = row.time - sample / self._samples_hz
        try:
            self.journal.append(
                [
                    row.time - self._recording_began,
                    *(value(row) for value in self._columns.values()),
                ]
            )
        except OSError as error:
            raise DeviceError(f"the journal cannot be written ({error})") from error

    def _tell(self) -> None:
        """Report how far the run is."""
        self._reported, row, duration = (
            time.monotonic(),
            self._row,
            (self.plan.stop - self.plan.first) / self._rate,
        )
        state, why, enabled = (
            self.supervisor.state,
            self.supervisor.why,
            self.supervisor.still_enabled,
        )
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
        touched = [j for j, drive in enumerate(self.machine.drives) if drive.was_told]
        self._moving = set(touched)
        stops = [asyncio.ensure_future(self._stop_drive(j)) for j in touched]
        for j, stop in zip(touched, stops, strict=True):
            stop.add_done_callback(partial(self._at_rest, j))
        feeling = asyncio.ensure_future(self._feel())
        self._tell_stop()
        await _outlive(stops, self.supervisor.abort)
        self._stopped = True
        feeling.cancel()
        await _outlive([feeling, *self._tending], self.supervisor.abort)
        # One that was cancelled before it began has told its drive nothing.
        complaints = [
            await self._disable(j) if stop.cancelled() else stop.result()
            for j, stop in zip(touched, stops, strict=True)
        ]
        # A lost line is one complaint.
        self.supervisor.finish(list(dict.fromkeys(filter(None, complaints))))
        self._tell_stop()

    def _tell_stop(self) -> None:
        """Report, but let nothing that goes wrong with that stand in the way of stopping."""
        try:
            self._tell()
        except BaseException as error:
            self.supervisor.abort(error)

    async def _stop_drive(self, joint: int) -> str | None:
        """Slow one drive down and disable it, whatever happens to the others; return why it could
        not be disabled."""
        drive, period = self.machine.drives[joint], 1.0 / self._rate
        answered = time.monotonic()
        try:
            for tending in self._tending[joint : joint + 1]:  # may be waiting for an answer still
                await _outlive([tending], self.supervisor.abort)
                # Whatever ended it is a reason to stop, and none to stop otherwise than all others
                # do.
                if not tending.cancelled() and (error := tending.exception()):
                    self.supervisor.abort(error)
            self._heed(joint)
            due_at = float(self.supervisor.sent_at[joint])
            while True:
                # On the host's clock: the device's counter may be what has failed. A sample after
                # the last was due, not after it was answered: a drive that samples before a
                # set-point comes goes on by itself, and is led back with a jerk. What was late by
                # more than half a sample is not caught up with.
                due_at = max(due_at, float(self.supervisor.sent_at[joint]) - 0.5 * period) + period
                await asyncio.sleep(
                    0.0 if drive.in_lockstep else max(0.0, due_at - time.monotonic())
                )
                try:
                    async with drive.device.turn():
                        if self.supervisor.is_stale(joint, time.monotonic()):
                            await self._find(joint)
                        if not (due := self.supervisor.stop(joint, time.monotonic())):
                            break
                        reference, halt = due
                        reading = await drive.exchange(reference, halt=halt)
                        answered = time.monotonic()
                        self.supervisor.hear(joint, answered)
                        self.supervisor.feel(joint, reading)
                # A lost reply alone is no reason to take a moving leg's torque away.
                except Unanswered:
                    if time.monotonic() - answered > self.machine.rig.safety.watchdog_s:
                        raise
        # Whatever it is, the drive may still hear that it shall disable.
        except BaseException as error:
            self.supervisor.abort(error)
        self._at_rest(joint)
        return await self._disable(joint)

    def _at_rest(self, joint: int, _: asyncio.Future | None = None) -> None:
        """Note that a drive is slowed down no longer."""
        self._moving.discard(joint)

    async def _disable(self, joint: int) -> str | None:
        """Take a drive's torque away; return why that could not be done."""
        drive, complaint, left = self.machine.drives[joint], "", DISABLE_TRIES
        while left:
            try:
                if left < DISABLE_TRIES:
                    await self._until_others_rest(joint)
                    await drive.device.line.renew()
                await drive.disable(
                    float(self.supervisor.sent[joint]), in_motion=left == DISABLE_TRIES
                )
                return None
            # It may have waited for its turn: that was no try.
            except asyncio.CancelledError as error:
                complaint = f"{drive.device.label}: {error!r}"
                continue
            except DeviceError as error:
                complaint = str(error)
            except BaseException as error:  # one drive's failure must not hide another's
                complaint = f"{drive.device.label}: {error!r}"
            left -= 1
        return complaint

    async def _until_others_rest(self, joint: int) -> None:
        """Wait until nobody else on a drive's line is being slowed down: a new connection takes
        long."""
        drives = self.machine.drives
        while any(drives[j].device.line is drives[joint].device.line for j in self._moving):
            await asyncio.sleep(1.0 / self._rate)

    async def _feel(self) -> None:
        """Watch the cuffs while the drives slow down: whoever is still pressed is not to be held
        there."""
        try:
            while not self.supervisor.pressing:
                self.supervisor.feel_cuffs(await self.machine.felt())
                await asyncio.sleep(1.0 / self._rate)
        except BaseException as error:
            # So it was told to end.
            if not (self._stopped and isinstance(error, asyncio.CancelledError)):
                self.supervisor.abort(error)


def run_to_its_end(run: Coroutine, note: Callable[[BaseException], None]) -> None:
    """Run a coroutine to its end in an event loop of its own, and whatever it raises there.

    An exception that ends the loop itself, as KeyboardInterrupt does, is noted, and the loop goes
    on: the coroutine has drives to disable.
    """
    with asyncio.Runner(loop_factory=exact_event_loop) as runner:
        loop = runner.get_loop()
        task = loop.create_task(run)
        for left in reversed(range(MOST_ENDED)):
            try:
                return loop.run_until_complete(task)
            except BaseException as error:
                # A loop that ends each time will not disable a drive any more.
                if task.done() or not left:
                    raise
                note(error)


async def _outlive(tasks: Iterable[asyncio.Future], note: Callable[[BaseException], None]) -> None:
    """Wait until all tasks have ended; what asks this one to end meanwhile is noted, and does not
    end them."""
    pending = set(tasks)
    while pending:
        try:
            _, pending = await asyncio.wait(pending)
        except BaseException as error:
            note(error)
