"""Exchanges with the drives during a run: set-points go out, answers go to the supervisor."""

import time
from collections.abc import Callable, Sequence
from functools import partial

from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.machine.machine import Machine, all_answers
from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.machine.row import Answers
from pipelines.acquisition.recording.latency_histogram import Latencies
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.errors import DeviceError

Decide = Callable[[int, float], float]
"""Decides which set-point (rad) a joint's drive is sent now, host's clock, s."""


class Exchange:
    """Carries out the supervisor's decisions."""

    def __init__(self, machine: Machine, supervisor: Supervisor, stopped_by: Sequence[str]) -> None:
        """Exchange with a machine's drives; ``stopped_by`` names the signals that have come."""
        self.machine, self._supervisor, self._stopped_by = machine, supervisor, stopped_by
        self.latencies = Latencies()
        self._cycle = 0

    def refuse_signals(self) -> None:
        """Refuse to go on where a signal asks for a stop.

        Raises
        ------
        DeviceError
            Names the signal.
        """
        if self._stopped_by:
            raise DeviceError(f"stopped by {self._stopped_by[0]}")

    async def cycle(self, decide: Decide) -> Answers:
        """Send every drive a set-point, and return the answers."""
        self._cycle += 1
        asked_at = time.perf_counter()
        answers = await self.machine.cycle(self._cycle, partial(self._in_turn, decide))
        self.latencies.add(time.perf_counter() - asked_at)
        for joint, drive in enumerate(self.machine.drives):
            # That is the time of the last answer, so a drive without one now is not marked.
            self._supervisor.trackers[joint].mark_answered(drive.answered_at)
            self.update(joint)
        return answers

    async def _in_turn(self, decide: Decide, drive: Drive) -> Reading:
        """Send a drive its set-point, decided when its turn comes: it may move on meanwhile."""
        joint = self.machine.drives.index(drive)
        async with drive.device.turn():
            now = time.monotonic()
            # One that may be anywhere by now is asked where it is first.
            tracker = self._supervisor.trackers[joint]
            if tracker.is_stale(now) or self._supervisor.is_late(now):
                await self.find(joint)
                # The cycle's step is outdated by now; `hold` steps by the host's clock.
                decide = self._supervisor.hold
            return await drive.exchange(decide(joint, time.monotonic()))

    async def find(self, joint: int) -> tuple[Reading, float]:
        """Ask a drive where it is, to go on from there.

        Parameters
        ----------
        joint : int
            Number of the joint.

        Returns
        -------
        tuple
            The answer, and its time, host's clock, s.

        Raises
        ------
        DeviceError
            The drive did not answer, or refused.
        """
        tracker = self._supervisor.trackers[joint]
        sent_at = tracker.sent_at
        reading, now = await self.machine.drives[joint].look(in_motion=True), time.monotonic()
        if tracker.sent_at == sent_at:
            self._supervisor.resume(joint, reading, now)
        else:  # it was sent a set-point meanwhile
            self._supervisor.enable_states.update(joint, reading)
        return reading, now

    async def find_all(self) -> tuple[int, float]:
        """Ask all drives where they are after a silence.

        Returns
        -------
        tuple
            Cycle of the first drive, and the answer's time, host's clock, s.

        Raises
        ------
        DeviceError
            A drive did not answer, or refused.
        """
        (first, now), *_ = await all_answers(
            self.find(joint) for joint in range(len(self.machine.drives))
        )
        return first.sequence // self.machine.samples_per_cycle, now

    def update(self, joint: int) -> None:
        """Pass on a drive's reports that came with other answers, or were asked again."""
        statuses = self.machine.drives[joint].statuses
        while statuses:
            self._supervisor.enable_states.update(joint, statuses.pop(0))
