"""Holds each drive while another one is awaited: it is sent set-points rather than nothing."""

import asyncio
import time
from contextlib import suppress

from pipelines.acquisition.exchange import Exchange
from pipelines.acquisition.safety.set_point_tracker import SLACK_SAMPLES
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.errors import Unanswered


class DriveHold:
    """One task a drive, for as long as the plan is followed."""

    def __init__(self, exchange: Exchange, supervisor: Supervisor) -> None:
        self._exchange, self._supervisor = exchange, supervisor
        self._ended = asyncio.Event()
        self.tasks: list[asyncio.Future] = []
        """By joint; they end with an error where something is wrong."""

    def start(self) -> None:
        """Start the tasks."""
        joints = range(len(self._exchange.machine.drives))
        self.tasks = [asyncio.ensure_future(self._hold(joint)) for joint in joints]

    def end(self) -> None:
        """Let the tasks end: the plan is followed no longer."""
        self._ended.set()

    async def _hold(self, joint: int) -> None:
        """Send one drive set-points while the plan waits for another one.

        Errors are raised here: the plan, which waits, cannot see them.
        """
        # Share of a sample between two looks whether a drive is sent nothing.
        look_pause = 0.25
        drive, tracker = self._exchange.machine.drives[joint], self._supervisor.trackers[joint]
        period = 1.0 / self._supervisor.rate
        # The plan itself sends one set-point a sample. This task steps in after two samples without
        # one.
        patience, look_at = SLACK_SAMPLES * period, 0.0
        while True:
            sent_at = tracker.sent_at
            due = max(sent_at + patience, look_at)
            with suppress(TimeoutError):
                async with asyncio.timeout(due - time.monotonic()):
                    await self._ended.wait()
                    return
            is_delayed = time.monotonic() - due > look_pause * period
            self._exchange.refuse_signals()
            self._supervisor.reason.refuse()
            if tracker.sent_at != sent_at:
                # The plan, or another task, has sent a set-point meanwhile.
                patience = SLACK_SAMPLES * period
            elif drive.device.awaited_s > period:
                # The plan waits for this very drive.
                look_at = time.monotonic() + look_pause * period
            elif is_delayed and due > look_at:
                # This computer was late: first the plan catches up.
                look_at = time.monotonic() + period
            else:
                await self._send(joint)
                patience = period

    async def _send(self, joint: int) -> None:
        """Send one drive where to go, from where it is, unless it is sent something meanwhile."""
        drive, tracker = self._exchange.machine.drives[joint], self._supervisor.trackers[joint]
        sent_at = tracker.sent_at
        with suppress(Unanswered):  # the exchange of the plan finds out for how long
            async with drive.device.turn():
                self._exchange.update(joint)
                if tracker.sent_at != sent_at:
                    return
                if tracker.is_stale(time.monotonic()):
                    await self._exchange.find(joint)
                reading = await drive.exchange(self._supervisor.hold(joint, time.monotonic()))
                tracker.mark_answered(time.monotonic())
                self._supervisor.check_held(joint, reading)
