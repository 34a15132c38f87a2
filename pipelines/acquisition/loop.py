"""The control loop: set-points out, samples in, and every drive disabled at its end."""

import asyncio
import time
from collections.abc import Coroutine, Sequence
from typing import Any

from pipelines.acquisition.drive_hold import DriveHold
from pipelines.acquisition.exchange import Exchange
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.machine.row import Row
from pipelines.acquisition.machine.sampling import Sampling
from pipelines.acquisition.pacing import Lockstep, PhaseLock
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.progress import ProgressReport, Report
from pipelines.acquisition.recording.journal import Journal
from pipelines.acquisition.recording.sample_writer import SampleWriter
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.acquisition.stopping import DISABLE_TRIES, Stopping
from pipelines.acquisition.uninterrupted import outlive
from pipelines.errors import Unanswered

__all__ = ["DISABLE_TRIES", "Loop"]


class Loop:
    """One run while it goes on."""

    def __init__(
        self,
        machine: Machine,
        supervisor: Supervisor,
        sampling: Sampling,
        plan: Plan,
        journal: Journal,
        report: Report,
        stopped_by: Sequence[str],
    ) -> None:
        """Follow a plan; ``stopped_by`` names the signals that have come."""
        self._machine, self._supervisor, self._sampling = machine, supervisor, sampling
        self._exchange = Exchange(machine, supervisor, stopped_by)
        self._hold = DriveHold(self._exchange, supervisor)
        samples = (plan.stop - plan.first) * machine.samples_per_cycle
        rate_hz = supervisor.rate * machine.samples_per_cycle
        self._writer = SampleWriter(journal, machine, samples, rate_hz)
        self._progress = ProgressReport(supervisor, plan, self._writer, report)
        self._row: Row | None = None
        """The last sample."""

    async def run(self) -> None:
        """Follow the plan to its end, then disable the drives; the supervisor has the reason."""
        try:
            self._supervisor.enabling.check_at_rest(await self._machine.look())
            await self._held(self._follow(await self._enable()))
        # Whatever it is: the drives come first, it is reported after them.
        except BaseException as error:
            self._supervisor.abort(error)
        stopping = Stopping(self._exchange, self._supervisor, self._hold.tasks, self._report_last)
        await stopping.run()

    def metadata(self) -> dict[str, Any]:
        """Return the run's metadata for its recording: clocks and latencies."""
        clocks = self._sampling.clocks(self._writer.began_at or 0.0)
        latency = self._exchange.latencies.metadata()
        if latency:
            latency = latency | {"left_out": self._supervisor.left_out}
        return ({"clocks": clocks} if clocks else {}) | ({"latency": latency} if latency else {})

    async def _enable(self) -> Row:
        """Enable the drives where the leg stands; return the first sample when all are enabled."""
        began_at = time.monotonic()
        while True:
            self._exchange.refuse_signals()
            answers = await self._exchange.cycle(self._supervisor.enabling.set_point)
            row = self._supervisor.enabling.check(answers, time.monotonic() - began_at)
            if row:
                break
            # Else the records of meanwhile would be in the way once the leg moves.
            await self._machine.forget_records()
            await asyncio.sleep(1.0 / self._supervisor.rate)
        now = time.monotonic()
        self._progress.begin(now)
        self._supervisor.begin(row, now)
        return row

    async def _held(self, following: Coroutine) -> None:
        """Follow the plan, and hold every drive meanwhile, until one of these ends."""
        follow = asyncio.ensure_future(following)
        # In lockstep no time passes while a drive is awaited.
        if self._machine.rig.clock == "real_time":
            self._hold.start()
        ended = set[asyncio.Future]()
        try:
            ended, _ = await asyncio.wait(
                [follow, *self._hold.tasks], return_when=asyncio.FIRST_COMPLETED
            )
        finally:
            self._hold.end()
            follow.cancel()
            self._sampling.end()
            await outlive([follow], self._supervisor.abort)
            for task in ended:
                error = asyncio.CancelledError() if task.cancelled() else task.exception()
                if error:
                    self._supervisor.abort(error)

    async def _follow(self, last: Row) -> None:
        """Send set-point after set-point; raise as soon as something is wrong."""
        supervisor, pace = self._supervisor, self._pace()
        while not supervisor.has_followed(last):
            cycle = await pace.wait(last.sequence)
            self._exchange.refuse_signals()
            now = time.monotonic()
            if supervisor.has_missed(cycle, now):
                try:
                    newest, now = await self._exchange.find_all()
                # `has_missed` refuses to go on once the watchdog has expired.
                except Unanswered:
                    continue
                # The drives have gone on while they were asked.
                cycle = max(cycle, newest)
            supervisor.advance(cycle, now)
            answers = await self._exchange.cycle(supervisor.set_point)
            row = supervisor.check_answers(answers, time.monotonic())
            if row is None:
                continue
            last = self._row = row
            for whole in await self._sampling.rows(row):
                self._keep(whole)
            self._progress.report_seldom(row)

    def _pace(self) -> Lockstep | PhaseLock:
        rig = self._machine.rig
        if rig.clock == "lockstep":
            return Lockstep(self._machine.count)
        return PhaseLock(self._supervisor.rate, self._machine.count, rig.safety.watchdog_s)

    def _keep(self, row: Row) -> None:
        """Write a sample of the recording."""
        self._writer.write(row, self._supervisor.progress.sample(row))

    def _report_last(self) -> None:
        """Report the last sample."""
        self._progress.report(self._row)
