"""The supervisor: the one place that decides every set-point, and when to stop.

It neither waits nor reads nor sends. The control loop passes it each answer and its time, and sends
the set-points that it returns. docs/safety.md draws its states and lists the conditions of each.
"""

from collections.abc import Sequence

from numpy.typing import NDArray

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.safety.enable_state import EnableStates
from pipelines.acquisition.safety.enabling import Enabling
from pipelines.acquisition.safety.plan_progress import PlanProgress
from pipelines.acquisition.safety.safe_stop import SafeStop
from pipelines.acquisition.safety.sample_checks import SampleChecks
from pipelines.acquisition.safety.set_point_tracker import SLACK_SAMPLES, SetPointTracker
from pipelines.acquisition.safety.stop_reason import StopReason
from pipelines.acquisition.states import FOLLOWING, TRANSITIONS, Conditions, State, check_guard
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import SensorSettings


class Supervisor:
    """The state of one run: each drive's set-points, and why the run was stopped.

    ``now`` is the host's clock, s. Methods raise DeviceError where there is a reason to stop.
    """

    def __init__(
        self, rig: RigSettings, sample_rate_hz: float, sensors: Sequence[SensorSettings] = ()
    ) -> None:
        """Supervise a run on a rig; ``sensors`` are the cuff sensors that are read."""
        self.rig, self.rate = rig, sample_rate_hz
        self.samples_per_cycle = rig.samples_per_cycle(sample_rate_hz)
        self.state = State.IDLE
        self.reason = StopReason()
        self.still_enabled = False
        """Whether a drive may not have taken it that it was sent to disable."""
        self.left_out = 0
        """Set-points that were left out because samples came too late or not at all."""
        joints = range(len(rig.drive))
        self.trackers = [SetPointTracker(rig, joint, sample_rate_hz) for joint in joints]
        self.enable_states = EnableStates(rig.drive)
        self.checks = SampleChecks(rig, sample_rate_hz, sensors)
        parts = self.trackers, self.enable_states, self.checks
        self.enabling = Enabling(rig, sample_rate_hz, *parts, self.reason)
        self.safe_stop = SafeStop(rig.safety, sample_rate_hz, *parts)
        self._due = State.RAMP
        """The state to which the set-point belongs that is due now."""

    @property
    def why(self) -> str | None:
        """The first reason to stop early; None while there is none."""
        return self.reason.text

    @property
    def also(self) -> list[str]:
        """Further reasons, in their order."""
        return self.reason.further

    @property
    def fault(self) -> BaseException | None:
        """The first error that was exoid's own."""
        return self.reason.fault

    @property
    def pressing(self) -> bool:
        """Whether slowing down would go on pressing."""
        return self.safe_stop.pressing

    def start_checks(self) -> None:
        """Begin to look at the devices."""
        self._go(State.CHECK)

    def load_plan(self, plan: Plan, start: NDArray) -> None:
        """Take the plan, and where the leg stood when it was made, (J,) rad."""
        self.progress = PlanProgress(plan, start, self.rate)
        self.enabling.start_at(start.tolist())

    def begin(self, row: Row, now: float) -> None:
        """Follow the plan from the first sample on at which the drives are enabled."""
        self.reason.refuse()
        self.progress.begin(row.sequence, now)
        for tracker, reading in zip(self.trackers, row.drives, strict=True):
            tracker.begin(reading, row.sequence, now)
        self.checks.begin(row, self.trackers, now)
        self._go(State.RAMP)

    def has_missed(self, cycle: int, now: float) -> bool:
        """Return whether a drive may have been sent nothing for longer than a sample by a cycle.

        What was sent and not answered may never have arrived, and a counter may have been set back.
        """
        self.reason.refuse()
        self.checks.refuse_silence(cycle, now)
        is_stale = any(tracker.is_stale(now) for tracker in self.trackers)
        return cycle - self.progress.cycle > 1 or is_stale

    def is_late(self, now: float) -> bool:
        """Return whether a newer cycle is due than that at which the plan was followed last."""
        follows = self.state in FOLLOWING and self.rig.clock != "lockstep"
        return follows and now - self.progress.followed_at > 1.0 / self.rate

    def resume(self, joint: int, reading: Reading, now: float) -> None:
        """Go on from where a drive is after a silence; raise DeviceError where it dropped out."""
        self.enable_states.update(joint, reading)
        self.trackers[joint].resume(reading, now)

    def hold(self, joint: int, now: float) -> float:
        """Return the set-point (rad) of a drive that is sent nothing else while another is awaited.

        It is the plan's, by the host's clock, for as long as one answer may take; then the drive
        slows down.
        """
        self.reason.refuse()
        awaited_s = now - self.progress.followed_at
        # One late reply is no reason to slow down: the plan goes on for as long as it may take.
        if awaited_s > self.rig.safety.longest_reply_s + SLACK_SAMPLES / self.rate:
            return self.trackers[joint].slow_down(now)
        cycle = self.progress.cycle + int(awaited_s * self.rate)
        return self.trackers[joint].hold_to_plan(self.progress.due(joint, cycle), cycle, now)

    def check_held(self, joint: int, reading: Reading) -> None:
        """Check the answer of a drive that is held while others are awaited."""
        if self.why is not None:
            self.safe_stop.check(joint, reading, late=1)
            return
        self.enable_states.update(joint, reading)
        self.checks.check_held(joint, reading, self.trackers)

    def advance(self, cycle: int, now: float) -> None:
        """Go on to the set-points that are due now that the sample of a cycle is latched."""
        self.reason.refuse()
        self.checks.refuse_silence(cycle, now)
        self._due = self.progress.state(cycle)
        # State by state, as after missed samples several may have gone by.
        while self.state is not self._due:
            self._go(FOLLOWING[FOLLOWING.index(self.state) + 1])
        left_out = max(cycle - self.progress.cycle - 1, 0)
        if left_out:
            self.left_out += left_out
            self.checks.leave_out(self.trackers, self.progress.cycle, cycle)
        self.progress.advance(cycle, now)

    def set_point(self, joint: int, now: float) -> float:
        """Return the set-point (rad) that a drive is sent now that its turn has come.

        It is the plan's. Where samples were missed it walks back there, no step larger than the
        speed limit.
        """
        self.reason.refuse()
        tracker, progress = self.trackers[joint], self.progress
        # A second step within one sample would be twice as fast.
        if not progress.has_advanced:
            return tracker.repeat(now)
        return tracker.follow_plan(progress.due(joint, progress.cycle), progress.cycle, now)

    def check_answers(self, answers: Answers, now: float) -> Row | None:
        """Return the sample that a cycle brought, where it is whole and new."""
        self.reason.refuse()
        self.enable_states.update_all(answers)
        return self.checks.check(answers, self.trackers, self.progress.cycle, now)

    def check_records(
        self, row: Row, records: Sequence[Sequence[Reading]], now: float
    ) -> list[list[Reading]]:
        """Return those samples of the drives' own records that are new."""
        self.reason.refuse()
        self.enable_states.update_records(records)
        return self.checks.check_records(row, records, now)

    def has_followed(self, row: Row) -> bool:
        """Return whether the plan is followed to its end; refuse to take far too long for it."""
        return self.progress.is_finished(row, self.trackers)

    def abort(self, error: BaseException) -> None:
        """Stop for an error; the first reason is kept, and further ones follow it."""
        is_reported = self.still_enabled or self.state is State.DISABLED
        self.reason.add(error, is_reported=is_reported)
        # An idle or disabled machine has nothing to stop.
        if State.ABORT in TRANSITIONS[self.state]:
            self._go(State.ABORT)

    def finish(self, complaints: Sequence[str]) -> None:
        """End the run, in abort with ``complaints`` of drives that may not be disabled."""
        self.reason.join(complaints)
        self.still_enabled = bool(complaints)
        end = State.ABORT if complaints else State.DISABLED
        if self.state is not end:
            self._go(end)

    def _go(self, state: State) -> None:
        conditions = Conditions(
            due=self._due,
            all_enabled=not self.enable_states.idle,
            all_disabled=not self.still_enabled,
            reason=self.why,
        )
        check_guard(self.state, state, conditions)
        self.state = state
