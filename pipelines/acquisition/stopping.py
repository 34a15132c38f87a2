"""The end of every run: each drive slows down and is disabled, whatever happens meanwhile."""

import asyncio
import time
from collections.abc import Callable, Sequence
from functools import partial

from pipelines.acquisition.exchange import Exchange
from pipelines.acquisition.machine.drive_protocol import disable
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.acquisition.uninterrupted import outlive
from pipelines.errors import DeviceError, Unanswered

DISABLE_TRIES = 3
"""How often a drive is sent to disable, each time but the first on a new connection."""


class Stopping:
    """Stops every drive that was sent anything."""

    def __init__(
        self,
        exchange: Exchange,
        supervisor: Supervisor,
        holding: Sequence[asyncio.Future],
        report: Callable[[], None],
    ) -> None:
        """Stop the drives of an exchange; tasks of ``holding`` may still hold some."""
        self._exchange, self._supervisor = exchange, supervisor
        self._drives = exchange.machine.drives
        self._holding, self._report = holding, report
        self._moving = set[int]()
        """Drives that are being slowed down."""
        self._has_ended = False
        """Whether all of them are disabled, or could not be."""

    async def run(self) -> None:
        """Bring every drive to rest and take its torque away."""
        # A drive that was sent nothing is disabled since `make_idle`.
        joints = [j for j, drive in enumerate(self._drives) if drive.was_sent]
        self._moving = set(joints)
        stops = [asyncio.ensure_future(self._stop(joint)) for joint in joints]
        for joint, stop in zip(joints, stops, strict=True):
            stop.add_done_callback(partial(self._note_at_rest, joint))
        cuffs = asyncio.ensure_future(self._watch_cuffs())
        self._report_safely()
        await outlive(stops, self._supervisor.abort)
        self._has_ended = True
        cuffs.cancel()
        await outlive([cuffs, *self._holding], self._supervisor.abort)
        # A stop that was cancelled before it began has sent its drive nothing.
        complaints = [
            await self._disable(joint) if stop.cancelled() else stop.result()
            for joint, stop in zip(joints, stops, strict=True)
        ]
        # A lost line is one complaint.
        self._supervisor.finish(list(dict.fromkeys(filter(None, complaints))))
        self._report_safely()

    def _report_safely(self) -> None:
        """Report, but let nothing that goes wrong with that stand in the way of stopping."""
        try:
            self._report()
        except BaseException as error:
            self._supervisor.abort(error)

    async def _stop(self, joint: int) -> str | None:
        """Slow one drive down and disable it; return why it could not be disabled."""
        began_at = time.monotonic()
        try:
            await self._end_holding(joint)
            self._exchange.update(joint)
            await self._slow_down(joint, began_at)
        # Whatever it is, the drive may still take it to disable.
        except BaseException as error:
            self._supervisor.abort(error)
        self._note_at_rest(joint)
        return await self._disable(joint)

    async def _end_holding(self, joint: int) -> None:
        """Wait until a drive is held no longer: an answer may still be awaited."""
        for task in self._holding[joint : joint + 1]:
            await outlive([task], self._supervisor.abort)
            # Whatever ended it is a reason to stop, and none to stop otherwise than all others do.
            if not task.cancelled() and (error := task.exception()):
                self._supervisor.abort(error)

    async def _slow_down(self, joint: int, answered_at: float) -> None:
        """Send a drive set-point after set-point until it is at rest.

        On the host's clock: the device's counter may have failed. Each is sent a sample
        after the last was due, not after it was answered: a drive that samples before a set-point
        comes goes on by itself, and is led back with a jerk. A delay of more than half a sample is
        not caught up with. The drive answered last at ``answered_at``, host's clock, s.
        """
        drive, tracker = self._drives[joint], self._supervisor.trackers[joint]
        period = 1.0 / self._supervisor.rate
        due_at = tracker.sent_at
        while True:
            due_at = max(due_at, tracker.sent_at - 0.5 * period) + period
            await asyncio.sleep(0.0 if drive.in_lockstep else max(0.0, due_at - time.monotonic()))
            try:
                async with drive.device.turn():
                    if tracker.is_stale(time.monotonic()):
                        await self._exchange.find(joint)
                    due = self._supervisor.safe_stop.set_point(joint, time.monotonic())
                    if due is None:
                        return
                    reference, halt = due
                    reading = await drive.exchange(reference, halt=halt)
                    answered_at = time.monotonic()
                    tracker.mark_answered(answered_at)
                    self._supervisor.safe_stop.check(joint, reading)
            # A lost reply alone is no reason to take a moving leg's torque away.
            except Unanswered:
                longest_s = self._exchange.machine.rig.safety.watchdog_s
                if time.monotonic() - answered_at > longest_s:
                    raise

    def _note_at_rest(self, joint: int, _: asyncio.Future | None = None) -> None:
        """Note that a drive is slowed down no longer."""
        self._moving.discard(joint)

    async def _disable(self, joint: int) -> str | None:
        """Take a drive's torque away; return why that could not be done."""
        drive, complaint, tries_left = self._drives[joint], "", DISABLE_TRIES
        tracker = self._supervisor.trackers[joint]
        while tries_left:
            is_first = tries_left == DISABLE_TRIES
            try:
                if not is_first:
                    await self._until_others_rest(joint)
                    await drive.device.line.renew()
                await disable(drive, tracker.sent, in_motion=is_first)
                return None
            # It may have waited for its turn: that was no try.
            except asyncio.CancelledError as error:
                complaint = f"{drive.device.label}: {error!r}"
                continue
            except DeviceError as error:
                complaint = str(error)
            except BaseException as error:  # one drive's failure must not hide another's
                complaint = f"{drive.device.label}: {error!r}"
            tries_left -= 1
        return complaint

    async def _until_others_rest(self, joint: int) -> None:
        """Wait until no other drive on the line is slowed down: a new connection takes long."""
        line = self._drives[joint].device.line
        while any(self._drives[j].device.line is line for j in self._moving):
            await asyncio.sleep(1.0 / self._supervisor.rate)

    async def _watch_cuffs(self) -> None:
        """Watch the cuffs while the drives slow down: nobody is held where cuffs press."""
        machine = self._exchange.machine
        sensors = list(machine.sensors)
        try:
            while sensors and not self._supervisor.pressing:
                answers = await asyncio.gather(
                    *(sensor.look() for sensor in sensors), return_exceptions=True
                )
                # A failed sensor, perhaps the reason of this stop, must not end the watch of the
                # others.
                for error in (one for one in answers if isinstance(one, BaseException)):
                    self._supervisor.abort(error)
                working = [
                    (sensor, answer)
                    for sensor, answer in zip(sensors, answers, strict=True)
                    if not isinstance(answer, BaseException)
                ]
                sensors = [sensor for sensor, _ in working]
                forces = machine.by_cuff(sensors, [answer for _, answer in working])
                self._supervisor.safe_stop.check_cuffs(forces)
                await asyncio.sleep(1.0 / self._supervisor.rate)
        except BaseException as error:
            # Else it was cancelled.
            if not (self._has_ended and isinstance(error, asyncio.CancelledError)):
                self._supervisor.abort(error)
