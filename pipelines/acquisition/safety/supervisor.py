"""The supervisor: the one place that decides what the drives are sent, and when nothing more.

It neither waits nor reads nor sends. The control loop passes it what came and when, and sends what
it returns. docs/safety.md draws its states and lists what holds in each.
"""

from collections.abc import Sequence

from numpy.typing import NDArray

from pipelines.acquisition.machine.reading import DriveStatus, Reading
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.safety.enable_state import EnableState, refuse_any, update_all
from pipelines.acquisition.safety.enabling import Enabling
from pipelines.acquisition.safety.plan_progress import PlanProgress
from pipelines.acquisition.safety.safe_stop import SafeStop
from pipelines.acquisition.safety.sample_checks import SampleChecks
from pipelines.acquisition.safety.set_point_tracker import SLACK_SAMPLES, SetPointTracker
from pipelines.acquisition.safety.stop_reason import StopReason
from pipelines.acquisition.states import FOLLOWING, TRANSITIONS, State
from pipelines.errors import DeviceError
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import SensorSettings

LONGEST_RETURN_S = 5.0
"""How long set-points may take to the end of their path once it is due."""


class Supervisor:
    """The state of one run: what each drive was sent, and why the run was stopped."""

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
        self.enable_states = [EnableState(drive.joint) for drive in rig.drive]
        self.checks = SampleChecks(rig, sample_rate_hz, sensors)
        parts = self.trackers, self.enable_states, self.checks
        self.enabling = Enabling(rig, sample_rate_hz, *parts)
        self.safe_stop = SafeStop(rig.safety, sample_rate_hz, *parts)
        self._cycle, self._cycle_at = 0, 0.0
        """The cycle at which the plan was followed last, and when, host's clock, s."""
        self._has_advanced = True
        """Whether that is another cycle than before: there is one step a cycle."""

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
        self.progress = PlanProgress(plan, start)
        self.enabling.start_at(start.tolist())

    def rest_set_point(self, joint: int, now: float) -> float:
        """Return the set-point (rad) with which a drive is enabled: where the leg stands."""
        self.refuse_after_abort()
        return self.enabling.set_point(joint, now)

    def begin(self, row: Row, now: float) -> None:
        """Follow the plan from the first sample on at which the drives are enabled."""
        self.refuse_after_abort()
        self.progress.first_cycle = self._cycle = row.sequence
        self._cycle_at = now
        for tracker, reading in zip(self.trackers, row.drives, strict=True):
            tracker.begin(reading, row.sequence, now)
        self.checks.begin(row, self.trackers, now)
        self._go(State.RAMP)

    def has_missed(self, cycle: int, now: float) -> bool:
        """Return whether a drive may have been sent nothing for longer than a sample by a cycle.

        What was sent and not answered may never have arrived, and a counter may have been set back.
        """
        self.refuse_after_abort()
        self.checks.refuse_silence(cycle, now)
        is_stale = any(tracker.is_stale(now) for tracker in self.trackers)
        return cycle - self._cycle > 1 or is_stale

    def is_late(self, now: float) -> bool:
        """Return whether a newer cycle is due than that at which the plan was followed last."""
        follows = self.state in FOLLOWING and self.rig.clock != "lockstep"
        return follows and now - self._cycle_at > 1.0 / self.rate

    def resume(self, joint: int, reading: Reading, now: float) -> None:
        """Go on from where a drive is after a silence; raise DeviceError where it dropped out."""
        self.update_enabled(joint, reading)
        self.trackers[joint].resume(reading, now)

    def hold(self, joint: int, now: float) -> float:
        """Return the set-point (rad) of a drive that is sent nothing else while another is awaited.

        It is the plan's, by the host's clock, for as long as one answer may take; then the drive
        slows down.
        """
        self.refuse_after_abort()
        awaited_s = now - self._cycle_at
        if awaited_s > self.rig.safety.longest_reply_s + SLACK_SAMPLES / self.rate:
            return self.trackers[joint].slow_down(now)
        cycle = self._cycle + int(awaited_s * self.rate)
        return self.trackers[joint].hold_to_plan(self.progress.due(joint, cycle), cycle, now)

    def check_held(self, joint: int, reading: Reading) -> None:
        """Check the answer of a drive that is held while others are awaited."""
        if self.why is not None:
            self.safe_stop.check(joint, reading, late=1)
            return
        self.update_enabled(joint, reading)
        self.checks.check_held(joint, reading, self.trackers)

    def advance(self, cycle: int, now: float) -> None:
        """Go on to the set-points that are due now that the sample of a cycle is latched."""
        self.refuse_after_abort()
        self.checks.refuse_silence(cycle, now)
        while self.state is not self.progress.state(cycle):
            self._go(FOLLOWING[FOLLOWING.index(self.state) + 1])
        self._has_advanced = cycle > self._cycle
        if left_out := max(cycle - self._cycle - 1, 0):
            self.left_out += left_out
            self.checks.leave_out(self.trackers, self._cycle, cycle)
        self._cycle, self._cycle_at = cycle, now

    def set_point(self, joint: int, now: float) -> float:
        """Return the set-point (rad) that a drive is sent now that its turn has come.

        It is the plan's. Where samples were missed it walks back there, no step larger than the
        speed limit.
        """
        self.refuse_after_abort()
        tracker = self.trackers[joint]
        if not self._has_advanced:
            return tracker.repeat(now)
        return tracker.follow_plan(self.progress.due(joint, self._cycle), self._cycle, now)

    def check_answers(self, answers: Answers, now: float) -> Row | None:
        """Return the sample that a cycle brought, where it is whole and new."""
        self.refuse_after_abort()
        update_all(self.enable_states, answers)
        return self.checks.check(answers, self.trackers, self._cycle, now)

    def check_records(
        self, row: Row, records: Sequence[Sequence[Reading]], now: float
    ) -> list[list[Reading]]:
        """Return those samples of the drives' own records that are new."""
        self.refuse_after_abort()
        states = zip(self.enable_states, records, strict=True)
        refuse_any([state.update(reading) for state, samples in states for reading in samples])
        return self.checks.check_records(row, records, now)

    def has_followed(self, row: Row) -> bool:
        """Return whether the set-points are at the end of the plan; refuse to be late for long."""
        past = self.progress.cycles_past_end(row)
        if past > LONGEST_RETURN_S * self.rate:
            raise DeviceError(
                f"the motion is {LONGEST_RETURN_S:g} s late and still not finished: too many"
                " samples are lost; check the line, or whether one drive's sample counter runs"
                " differently from the other's"
            )
        end = self.progress.at(self.progress.length).tolist()
        pairs = zip(self.trackers, end, strict=True)
        at_end = [abs(tracker.sent - angle) <= tracker.resolution for tracker, angle in pairs]
        return past > 0 and all(at_end)

    def abort(self, error: BaseException) -> None:
        """Stop for an error; the first reason is kept, and further ones follow it."""
        is_reported = self.still_enabled or self.state is State.DISABLED
        self.reason.add(error, is_reported=is_reported)
        if State.ABORT in TRANSITIONS[self.state]:
            self._go(State.ABORT)

    def update_enabled(self, joint: int, status: DriveStatus) -> None:
        """Note a drive's report; raise DeviceError where it has a fault or is no longer enabled."""
        refuse_any([self.enable_states[joint].update(status)])

    def finish(self, complaints: Sequence[str]) -> None:
        """End the run; ``complaints`` are of drives that may not have taken it to disable.

        Disabled is only what is known to be: with a complaint a run ends in abort.
        """
        self.reason.join(complaints)
        self.still_enabled = bool(complaints)
        end = State.ABORT if complaints else State.DISABLED
        if self.state is not end:
            self._go(end)

    def refuse_after_abort(self) -> None:
        """Refuse to go on where the run is being stopped."""
        if self.why is not None:
            raise DeviceError(self.why)

    def _go(self, state: State) -> None:
        assert state in TRANSITIONS[self.state], f"there is no way from {self.state} to {state}"
        self.state = state
