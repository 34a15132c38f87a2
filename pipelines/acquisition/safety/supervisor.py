"""The safety state machine: the one place that decides what the drives are told, and when nothing
more.

It is pure: it neither waits nor reads nor sends. ``loop`` tells it what came and when, and sends
what it returns. docs/safety.md draws it.
"""

from asyncio import CancelledError
from collections.abc import Sequence
from math import copysign, sqrt

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine.drive import Condition, Reading
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.acquisition.modbus.wraparound import RATE_TOLERANCE
from pipelines.acquisition.plan import Plan
from pipelines.acquisition.safety.cuff_checks import Cuffs
from pipelines.acquisition.safety.limits import HOLD_SAMPLES, Limits, clamped, refuse_leap, slowed
from pipelines.acquisition.safety.record_agreement import Agreement
from pipelines.acquisition.safety.sample_checks import Stream
from pipelines.acquisition.safety.stuck_register import ANSWER_CYCLES, Told
from pipelines.acquisition.states import FOLLOWING, TRANSITIONS, State
from pipelines.errors import DeviceError, Unanswered
from pipelines.mechanics.motion import CUFFS
from pipelines.settings.rig import RigSettings, SensorSettings

REST_RAD = 0.02
"""How far the leg may have moved between the plan and the moment at which the drives are
enabled."""
WALK = 0.8
"""Share of its speed limit at which a joint is led back to the plan: at the whole of it a drive
that follows well would break it by what it overshoots, and by a count."""
SLACK_SAMPLES = 2
"""How far set-points may be ahead of their speed limit for a moment: they come in step with
samples, which the host sees up to one sample late or early."""

DRIFT = 0.01
"""Share of a cycle by which drives' clocks may part in one: far more than any two do."""
NO_LAG_RAD = 1e-9
"""What rounding leaves between a set-point and the plan."""
LONGEST_RETURN_S = 5.0
"""How long set-points may take to the end of their path once it is due."""


class Supervisor:
    """The state of one run, what was sent last, and why it was stopped."""

    def __init__(
        self, rig: RigSettings, sample_rate_hz: float, sensors: Sequence[SensorSettings] = ()
    ) -> None:
        """Supervise a run on a rig; ``sensors`` are the cuff sensors that are read."""
        self.rig = rig
        self.rate = sample_rate_hz
        self.samples_per_cycle = rig.samples_per_cycle(sample_rate_hz)
        self.state = State.IDLE
        self.why: str | None = None
        """The first reason to stop early; None while there is none."""
        self.also: list[str] = []
        """What else went wrong after that, in its order."""
        self.fault: BaseException | None = None
        """The first error that was exoid's own."""
        self.still_enabled = False
        """Whether a drive may not have taken it that it was told to disable."""
        self.sent = np.zeros(len(rig.drive))
        """(J,) last set-points, rad; to begin with, where the leg stands."""
        self.base = np.zeros_like(self.sent)
        """(J,) set-points, rad, from which the next ones step: the last ones, or what drives made
        of a silence."""
        self.sent_at = np.zeros_like(self.sent)
        """(J,) when they were sent, host's clock, s."""
        self._heard_at = np.zeros_like(self.sent)
        """(J,) when each drive answered last, host's clock, s: what it was sent since may not have
        arrived."""
        self._unheard = np.zeros(len(rig.drive), dtype=int)
        """(J,) set-points since each drive answered last."""
        self.pressing = False
        """Whether slowing down would go on pressing: the drives are then disabled without it."""
        self._limits = Limits(rig, sample_rate_hz, sensors)
        self._cuffs = Cuffs(sample_rate_hz)
        self._told = [Told() for _ in rig.drive]
        self._streams = [Stream(rig, j, sample_rate_hz, told) for j, told in enumerate(self._told)]
        self._records = [Stream(rig, j, sample_rate_hz, told) for j, told in enumerate(self._told)]
        recorded_hz = sample_rate_hz * self.samples_per_cycle
        self._agreements = [Agreement(rig, j, recorded_hz) for j in range(len(rig.drive))]
        self._speed = np.zeros_like(self.sent)
        """(J,) rad/s at which set-points move: a stop slows down from there, the way back to the
        plan begins there."""
        self._pace = np.zeros_like(self.sent)
        """(J,) rad/s at which a drive may go on by itself: as its last set-point did from the one
        before."""
        counts = [rig.map.drive[drive.map].write.reference.step for drive in rig.drive]
        self._nearest = np.maximum(counts, NO_LAG_RAD)
        """(J,) rad within which a set-point is another: drives cannot be told it more finely."""
        self._ahead = np.zeros_like(self.sent)
        """(J,) samples by which each drive's counter is ahead of the machine's cycles when its
        set-points come."""
        self._goes_on_since: list[float | None] = [None for _ in rig.drive]
        """In which of the machine's cycles a drive that goes on by itself was where it is led on
        from; None where it holds, or was told something since."""
        self._held = [0 for _ in rig.drive]
        """For how many samples each drive has been held at rest in the stop."""
        self._in_force = self.sent.copy()
        """(J,) set-points, rad, that are reached at the sample which is latched when the last ones
        are sent."""
        self._lead = np.zeros_like(self.sent)
        """By how much the set-points are ahead of what the speed limits allow, s; never more than
        the slack."""
        self._enabled: list[bool | None] = [None for _ in rig.drive]
        """What each drive said last of being enabled."""
        self._let_go = [False for _ in rig.drive]
        """Which drives have told a fault, or that they were no longer enabled; by the next word
        they may be again."""
        self._start = self.sent
        self.left_out = 0
        """How many set-points were left out, for samples were found too late or not at all."""
        self._first = self._found = 0
        self._advanced = True
        """Whether the sample found last is another one than before: there is one step a sample."""
        self._found_at = 0.0
        """When the sample was found at which the plan was followed last, host's clock, s."""

    def check(self) -> None:
        """Begin to look at the devices."""
        self._go(State.CHECK)

    def take(self, plan: Plan, start: NDArray) -> None:
        """Take the plan, and where the leg stood when it was made, (J,) rad."""
        self._plan = plan
        self._start = start
        self.sent[:] = self.base[:] = start

    def check_rest(self, row: Row) -> None:
        """Refuse to enable drives whose leg no longer stands where the plan begins, or breaks a
        limit."""
        for drive, planned, found in zip(self.rig.drive, self.sent, row.angle, strict=True):
            # The drive goes from where the leg stands to its first set-point within one sample.
            if not abs(found - planned) <= min(REST_RAD, drive.speed_rad_s / self.rate):
                raise DeviceError(
                    f"the {drive.joint} moved from {planned:.3f} to {found:.3f} rad before its"
                    " drive was enabled; keep the leg still and start again"
                )
        if why := self._dropped(row) or self._limits.violation(row):
            raise DeviceError(why)

    def rest(self, joint: int, now: float) -> float:
        """Return the set-point (rad) with which a drive is enabled now: where the leg stands."""
        self.refuse_after_abort()
        return self._follow(joint, float(self._start[joint]), 0.0, now)

    def enabled(self, answers: Answers, waited_s: float) -> Row | None:
        """Return the sample at which every drive says that it is enabled, as far as it tells; None
        until then.

        Refuse to wait too long for it.
        """
        if why := self._dropped(answers):
            raise DeviceError(why)
        silent = [told for told in answers.drives if isinstance(told, Unanswered)]
        if silent and waited_s > self.rig.safety.watchdog_s:
            raise silent[0]
        idle = [
            drive
            for drive, enabled in zip(self.rig.drive, self._enabled, strict=True)
            if enabled is False
        ]
        if idle and waited_s > self.rig.safety.control_s:
            raise DeviceError(
                f"drive {idle[0].joint}: was told to enable, but its status word does not say that"
                f" it is after {self.rig.safety.control_s:g} s; see the drive's manual, correct"
                " enabled_mask and enabled_value in the rig file, or raise safety.control_s there"
            )
        if why := self._limits.violation(answers) or self._limits.straying(answers, self._start):
            raise DeviceError(why)
        return None if idle else answers.row

    def begin(self, row: Row, now: float) -> None:
        """Follow the plan from the first sample on at which the drives are enabled."""
        self.refuse_after_abort()
        self._first = self._found = row.sequence
        self._found_at = now
        self._heard_at[:] = now
        for j, found in enumerate(row.drives):
            self._ahead[j] = found.sequence - row.sequence * self.samples_per_cycle
            self._streams[j].begin(found, now)
            self._told[j].tell(found.sequence, float(self.sent[j]))
        self._go(State.RAMP)

    def missed(self, found: int, now: float) -> bool:
        """Tell whether a drive may have been told nothing for longer than a sample by the time a
        sample is ``found``.

        What was sent and not answered may never have arrived, and a counter may have been set back.
        """
        self.refuse_after_abort()
        self._look(found, now)
        return found - self._found > 1 or any(
            self.is_stale(joint, now) for joint in range(len(self.sent))
        )

    def _look(self, found: int, now: float) -> None:
        """Refuse to go on after too long a silence, or with a counter that runs backwards or
        leaps."""
        for stream in self._streams:
            stream.refuse_silence(now)
        self._streams[0].refuse_count((found + 1) * self.samples_per_cycle - 1)

    def hear(self, joint: int, at: float) -> None:
        """Note when a drive has answered, so that what it was sent has arrived."""
        if at > self._heard_at[joint]:
            self._heard_at[joint], self._unheard[joint] = at, 0

    def is_stale(self, joint: int, now: float) -> bool:
        """Tell whether nobody knows what a drive has made of its set-points: the last answer is too
        old.

        In lockstep a drive holds the last one that arrived, however long, and those that did not
        add up to a leap.
        """
        if self._pace[joint] == 0.0:  # one that is held has nowhere to go on to
            return False
        if self.rig.clock == "lockstep":
            return bool(self._unheard[joint] >= SLACK_SAMPLES)
        return bool(now - self._heard_at[joint] > SLACK_SAMPLES / self.rate)

    def is_late(self, now: float) -> bool:
        """Tell whether the sample found last is no longer the newest, so that what is due at it is
        due no more."""
        follows = self.state in FOLLOWING and self.rig.clock != "lockstep"
        return follows and now - self._found_at > 1.0 / self.rate

    def resume(self, joint: int, reading: Reading, now: float) -> None:
        """Go on from where a drive is that was told nothing for a while: some hold meanwhile,
        others go on.

        Raises
        ------
        DeviceError
            The drive is no longer enabled.
        """
        self.heed(joint, reading)
        self.hear(joint, now)
        drive, sent, silent_s = self.rig.drive[joint], self.sent[joint], now - self.sent_at[joint]
        if self.rig.map.drive[drive.map].read.reference is not None:
            reach = drive.speed_rad_s * silent_s
            place = clamped(reading.reference, sent - reach, sent + reach)
        else:  # its leg lags behind one that holds, and is ahead with one that goes on
            place = clamped(reading.angle, *sorted((sent, sent + self._pace[joint] * silent_s)))
        speed = (place - sent) / silent_s if np.isnan(reading.velocity) else reading.velocity
        self.base[joint] = self._in_force[joint] = place
        self._speed[joint] = clamped(speed, *sorted((0.0, self._speed[joint])))
        goes_on = (place - sent) * self._pace[joint] > self._nearest[joint] * abs(self._pace[joint])
        cycle = float(reading.sequence - self._ahead[joint]) / self.samples_per_cycle
        self._goes_on_since[joint] = cycle if goes_on and self.rig.clock != "lockstep" else None

    def _lead_on(self, joint: int, found: int) -> None:
        """Lead a drive that goes on by itself on from where it is once a sample is found, not where
        it was when asked.

        Asked longer ago than a sample, it may have done anything since.
        """
        since = self._goes_on_since[joint]
        if since is not None and abs(found - since) <= 1.0:
            self.base[joint] += self._speed[joint] * (found - since) / self.rate
            self._in_force[joint] = self.base[joint]

    def tend(self, joint: int, now: float) -> float:
        """Return the set-point (rad) of a drive that would else be told nothing, since another one
        is awaited.

        It is the plan's, by the host's clock, for as long as one answer may take; then the drive
        slows down.

        Raises
        ------
        DeviceError
            Where nothing more may be sent.
        """
        self.refuse_after_abort()
        awaited_s = now - self._found_at
        if awaited_s > self.rig.safety.longest_reply_s + SLACK_SAMPLES / self.rate:
            return self._slow(joint, now)
        path, speed = self._towards(joint, self._found + int(awaited_s * self.rate), now)
        return self._pass(joint, path, speed, now)

    def judge_tended(self, joint: int, reading: Reading) -> None:
        """Raise DeviceError where what a drive tells that is tended is reason to stop."""
        if self.why is not None:
            self.feel(joint, reading, late=1)
            return
        silent = Unanswered("others are awaited")
        told = tuple(reading if j == joint else silent for j in range(len(self.rig.drive)))
        answers = Answers(told, np.full((len(CUFFS), 3), np.nan), None)
        if why := self._dropped(answers):
            raise DeviceError(why)
        # The sample was latched before the set-point that was sent with the question takes effect.
        if why := self._limits.violation(answers) or self._limits.straying(
            answers, self.base, late=1
        ):
            raise DeviceError(self._after_jerk(why))
        self._told[joint].tell(reading.sequence, float(self.sent[joint]))

    def next(self, found: int, now: float) -> None:
        """Go on to what is due now that sample ``found`` is latched.

        Raises
        ------
        DeviceError
            Where nothing more may be sent.
        """
        self.refuse_after_abort()
        self._look(found, now)
        while self.state is not self._due(self._index(found)):
            self._go(FOLLOWING[FOLLOWING.index(self.state) + 1])
        self._advanced = found > self._found
        if left_out := max(found - self._found - 1, 0):
            self.left_out += left_out
            for stream, record, ahead in zip(
                self._streams, self._records, self._ahead, strict=True
            ):
                since, until = (
                    cycle * self.samples_per_cycle + int(ahead) for cycle in (self._found, found)
                )
                stream.leave_out(since, until)
                record.leave_out(since, until)
        self._found, self._found_at = found, now

    def step(self, joint: int, now: float) -> float:
        """Return the set-point (rad) that a drive is sent now that its turn has come.

        It is the plan's. Where samples were missed it walks back there, no step larger than the
        speed limit.

        Raises
        ------
        DeviceError
            Where nothing more may be sent.
        """
        self.refuse_after_abort()
        path, speed = float(self.base[joint]), float(self._speed[joint])
        if self._advanced:
            path, speed = self._towards(joint, self._found, now)
        return self._follow(joint, path, speed, now)

    def judge(self, answers: Answers, now: float) -> Row | None:
        """Return the sample that a cycle brought, where it is whole and a new one.

        Raises
        ------
        DeviceError
            Where anything that came, whole or not, is reason to stop.
        """
        self.refuse_after_abort()
        if why := self._dropped(answers):
            raise DeviceError(why)
        new = [self._is_new(j, found, now) for j, found in enumerate(answers.drives)]
        if why := self._limits.cuff_violation(answers) or self._straying(answers):
            raise DeviceError(self._after_jerk(why))
        row = answers.row
        if row is None or not new[0]:  # the first drive's counter is the machine's
            return None
        if why := self._cuffs.doubt(row.forces, row.sequence, self._travel(row)):
            raise DeviceError(why)
        return row

    def _after_jerk(self, why: str) -> str:
        """Return why to stop, with what may have jerked the leg shortly before: one drive moves the
        whole of it."""
        return next(
            (told for stream in self._streams if (told := stream.after_jerk(why)) != why), why
        )

    def _straying(self, answers: Answers) -> str | None:
        """Return which joint is too far from its set-point; without the machine's counter nobody
        knows from which."""
        first = answers.drives[0]
        if isinstance(first, Unanswered):
            return None
        late = abs(first.sequence // self.samples_per_cycle - self._found)
        return self._limits.straying(answers, self._in_force, late)

    def _is_new(self, joint: int, found: Reading | Unanswered, now: float) -> bool:
        """Tell whether an answer is a new sample; raise DeviceError where it, or silence, is reason
        to stop."""
        stream = self._streams[joint]
        if isinstance(found, Unanswered):
            stream.miss(found)
            is_new = False
        else:
            if is_new := stream.take(found, now):
                self._meet(joint, found)
            # What was sent with the question takes effect after the sample that it brought.
            self._told[joint].tell(found.sequence, float(self.sent[joint]))
        stream.refuse_silence(now)
        return is_new

    def _meet(self, joint: int, found: Reading) -> None:
        """Note how far a drive's counter was ahead when its set-point came: the least of late, for
        one may come late.

        It may grow slowly, as clocks of their own drift apart.
        """
        ahead = found.sequence - self._found * self.samples_per_cycle
        self._ahead[joint] = min(self._ahead[joint] + DRIFT * self.samples_per_cycle, ahead)

    def _travel(self, row: Row) -> float:
        """Return how far the joints were told to go up to a sample, all together, rad."""
        pairs = zip(self._told, row.drives, strict=True)
        lag = ANSWER_CYCLES * row.samples_per_cycle
        return sum(told.at(found.sequence - lag).travel for told, found in pairs)

    def judge_records(
        self, row: Row, records: Sequence[Sequence[Reading]], now: float
    ) -> list[list[Reading]]:
        """Return those samples of the drives' own records that are new, beside the row of a cycle.

        Raises
        ------
        DeviceError
            Where one is reason to stop, or they do not come any more.
        """
        self.refuse_after_abort()
        heeded = [
            self._heed_enabled(joint, found)
            for joint, samples in enumerate(records)
            for found in samples
        ]
        if why := next(filter(None, heeded), None):
            raise DeviceError(why)
        kept = []
        of_drives = zip(self._records, self._agreements, row.drives, records, strict=True)
        for stream, agreement, newest, samples in of_drives:
            agreement.tell(newest)
            kept.append([found for found in samples if stream.take(found, now)])
            for found in kept[-1]:
                agreement.judge(found)
            stream.refuse_to_fall_behind(newest.sequence)
        return kept

    def has_followed(self, row: Row) -> bool:
        """Tell whether the plan is at its end with a sample, and the set-points have walked there,
        but for a count.

        Raises
        ------
        DeviceError
            They have not for long: samples are missed faster than they are made up for.
        """
        # What is sent while a sample is latched is reached at the end of the next one.
        end = len(self._plan.reference)
        past = row.sequence - self._first - end
        if past > LONGEST_RETURN_S * self.rate:
            raise DeviceError(
                f"the set-points are not at the end of their path {LONGEST_RETURN_S:g} s after it,"
                " for samples are missed again and again; its answers are lost too often, or a"
                " drive's counter has parted from the other's"
            )
        return past > 0 and bool((np.abs(self.sent - self._path(end)) <= self._nearest).all())

    def index(self, row: Row) -> int:
        """Return which set-point of the plan a sample carries; outside the plan before and after
        it."""
        return row.sequence - self._first - 2

    def sample(self, row: Row) -> int:
        """Return how many samples of its drives a row is after the beginning of the recording, if
        not before it.

        Set-point m of the plan is reached 2 + m cycles after the first. Time 0 is where the
        trajectory begins, half a cycle before the plan's first set-point is reached.
        """
        cycle = row.samples_per_cycle
        reached = row.drives[0].sequence - (self._first + 2) * cycle
        return reached - (self._plan.first - 1) * cycle - cycle // 2 - 1

    def abort(self, error: BaseException) -> None:
        """Stop, whatever it was; the first reason is kept, and what else goes wrong is told after
        it."""
        ours = not isinstance(error, DeviceError | KeyboardInterrupt | SystemExit | CancelledError)
        if ours and self.fault is None:
            self.fault = error
        reason = _reason(error)
        if self.why is None:
            self.why = reason
        elif reason not in (self.why, *self.also):
            self.also.append(reason)
            # The others have been told already.
            if self.still_enabled or self.state is State.DISABLED:
                self.why = f"{self.why}; then {reason}"
        if State.ABORT in TRANSITIONS[self.state]:
            self._go(State.ABORT)

    def stop(self, joint: int, now: float) -> tuple[float, bool] | None:
        """Return the set-point, rad, that brings one drive to rest or holds it there, and whether
        it is to halt there.

        One a sample; None as soon as it has been held for long enough, as holding on would go on
        pressing, or as the drive says that it is not enabled: it must not be told to enable with
        its leg anywhere.
        """
        let_go = self._let_go[joint] or self._enabled[joint] is False
        if self._held[joint] >= HOLD_SAMPLES or self.pressing or let_go:
            return None
        base = self.base[joint]
        reference = self._slow(joint, now)
        halt = reference == base
        self._held[joint] += halt
        return reference, halt

    def _slow(self, joint: int, now: float) -> float:
        """Return the set-point (rad) of a drive that slows down, a sample after its last one."""
        deceleration = self.rig.safety.deceleration_rad_s2
        path, speed = slowed(
            float(self.base[joint]), self._speed[joint], deceleration, 1.0 / self.rate
        )
        return self._pass(joint, path, speed, now)

    def _pass(self, joint: int, path: float, speed: float, now: float) -> float:
        """Let a drive's set-point (rad) pass, as near to ``path`` as its limits allow by now."""
        drive, sent = self.rig.drive[joint], self.sent[joint]
        reach = drive.speed_rad_s * self._allowed_s(joint, now)
        reference = clamped(clamped(path, sent - reach, sent + reach), *drive.angle_rad)
        refuse_leap(drive, self.base[joint], reference, 1.0 / self.rate)
        return self._send(joint, reference, speed, now)

    def heed(self, joint: int, condition: Condition) -> None:
        """Note what a drive says of being enabled; raise DeviceError where it no longer is."""
        if why := self._heed_enabled(joint, condition):
            raise DeviceError(why)

    def feel(self, joint: int, reading: Reading, late: int = 0) -> None:
        """Heed what a drive tells that is being stopped; raise DeviceError where it is no longer
        enabled.

        Its set-point is so many samples ``late``.
        """
        drive, error = self.rig.drive[joint], reading.angle - self.base[joint]
        allowed = self.rig.safety.following_error_rad + drive.speed_rad_s * late / self.rate
        self.pressing |= not abs(reading.torque) <= drive.torque_nm
        self.pressing |= not abs(error) <= allowed
        self.heed(joint, reading)

    def feel_cuffs(self, forces: NDArray) -> None:
        """Heed the cuff forces (4, 3) N while the drives are being stopped."""
        self.pressing |= self._limits.force_violation(forces) is not None

    def finish(self, complaints: Sequence[str]) -> None:
        """Note that the drives were told to disable; ``complaints`` are of those that may not have
        taken it.

        Disabled is what is known to be: with a complaint a run ends in abort.
        """
        if self.why is not None:
            self.why = "; then ".join((self.why, *self.also))
        if not complaints:
            self._go(State.DISABLED)
            return
        self.still_enabled = True
        self.why = (
            f"{self.why or 'the run is complete'}; and could not be disabled:"
            f" {'; '.join(complaints)}"
        )
        if self.state is not State.ABORT:
            self._go(State.ABORT)

    def _go(self, state: State) -> None:
        assert state in TRANSITIONS[self.state], f"there is no way from {self.state} to {state}"
        self.state = state

    def _due(self, index: int) -> State:
        """Return the state to which a set-point of the path belongs; its first is where the leg
        stood."""
        if index - 1 < self._plan.first:
            return State.RAMP
        return State.RUN if index - 1 < self._plan.stop else State.RAMP_DOWN

    def _index(self, found: int) -> int:
        """Return which set-point of the path is due at a sample."""
        return min(max(found - self._first, 0), len(self._plan.reference))

    def _towards(self, joint: int, found: int, now: float) -> tuple[float, float]:
        """Return a set-point (rad) along the plan, or on the way back to it, and how fast it moves,
        rad/s.

        The way back begins as fast as set-points move already, and goes faster and slower as gently
        as a stop does: a drive that is sent from rest to its speed limit within a sample jerks the
        leg with all of its torque. It is no longer than the time allows: after a late set-point the
        next comes soon, and both may fall into one sample.

        Raises
        ------
        DeviceError
            The plan leaps there or leaves its limits, or is too far ahead.
        """
        drive, moves = self.rig.drive[joint], float(self._speed[joint])
        due, before, earlier = (
            float(self._path(self._index(found - back))[joint]) for back in range(3)
        )
        refuse_leap(drive, before, due, 1.0 / self.rate)
        self._lead_on(joint, found)
        base = float(self.base[joint])
        along, was, lag = (due - before) * self.rate, (before - earlier) * self.rate, before - base
        if lag == 0.0 and moves == was:
            return due, along
        deceleration, took_s = (
            self.rig.safety.deceleration_rad_s2,
            min(self._elapsed_s(joint, now), 1.0 / self.rate),
        )
        # Half of what a stop slows down by is left for what samples make of a parabola.
        softly = min(abs(lag) * self.rate, sqrt(deceleration * abs(lag)))
        change = max(deceleration, abs(along - was) * self.rate) * took_s
        fastest = max(abs(along), WALK * drive.speed_rad_s)
        speed = clamped(along + copysign(softly, lag), moves - change, moves + change)
        speed = clamped(speed, -fastest, fastest)
        on_plan = abs(lag) < NO_LAG_RAD and speed == along
        reference = base + (due - before if on_plan else speed * took_s)
        self._refuse_to_lag(joint, abs(due - reference))
        return (due if abs(reference - due) < NO_LAG_RAD else reference), speed

    def _path(self, index: int) -> NDArray:
        """Return the set-points (J,) rad of the path, whose first is where the leg stood."""
        return self._plan.reference[index - 1] if index else self._start

    def _heed_enabled(self, joint: int, told: Condition) -> str | None:
        """Note what a drive says of being enabled; return why to stop where it no longer is, and
        was, or has a fault.

        A drive with a fault counts as not enabled: it may be again as soon as the fault is cleared.
        """
        dropped = bool(self._enabled[joint]) and told.enabled is False
        if told.enabled is not None:
            self._enabled[joint] = told.enabled
        self._let_go[joint] |= dropped or told.fault is not None
        if told.fault or not dropped:
            return told.fault
        return (
            f"drive {self.rig.drive[joint].joint}: its status word says that it is no longer"
            " enabled; was the emergency stop pressed?"
        )

    def _dropped(self, told: Row | Answers) -> str | None:
        """Return why to stop where a drive is no longer enabled; note what each of them says."""
        found = [
            self._heed_enabled(j, one)
            for j, one in enumerate(told.drives)
            if isinstance(one, Reading)
        ]
        return next(filter(None, found), None)

    def _refuse_to_lag(self, joint: int, lag: float) -> None:
        """Refuse to go on where what was missed, rad, cannot be walked back to in reasonable
        time."""
        drive = self.rig.drive[joint]
        allowed = drive.speed_rad_s * self.rig.safety.watchdog_s
        if not lag <= allowed:
            raise DeviceError(
                f"{drive.joint}: its set-points are {lag:.3f} rad behind the plan after missed"
                f" samples, allowed are {allowed:.3f} rad (speed_rad_s x watchdog_s); its answers"
                " are lost too often, or this computer is too busy"
            )

    def refuse_after_abort(self) -> None:
        """Refuse to go on where the run is being stopped."""
        if self.why is not None:
            raise DeviceError(self.why)

    def _follow(self, joint: int, reference: float, speed: float, now: float) -> float:
        """Let a set-point (rad) of the plan, or of the way back there, pass; refuse one beyond the
        limits."""
        drive = self.rig.drive[joint]
        refuse_leap(drive, self.base[joint], reference, 1.0 / self.rate)
        refuse_leap(drive, self.sent[joint], reference, self._allowed_s(joint, now))
        self._in_force[joint] = self.base[joint]
        return self._send(joint, reference, speed, now)

    def _elapsed_s(self, joint: int, now: float) -> float:
        """Return the time since a drive's last set-point, s.

        By the host's clock, or by cycles in lockstep: a counter that runs too fast does not make
        time go by.
        """
        if self.rig.clock == "lockstep":
            return 1.0 / self.rate
        return float(now - self.sent_at[joint]) * (1.0 + RATE_TOLERANCE)

    def _allowed_s(self, joint: int, now: float) -> float:
        """Return for how long a joint's speed limit may have led it from its last set-point to its
        next, s."""
        return self._elapsed_s(joint, now) + SLACK_SAMPLES / self.rate - float(self._lead[joint])

    def _send(self, joint: int, reference: float, speed: float, now: float) -> float:
        """Note the set-point (rad) that a drive is sent now, and how fast it moves, rad/s; return
        it."""
        taken = abs(reference - self.sent[joint]) / self.rig.drive[joint].speed_rad_s
        ahead = self._lead[joint] + taken - self._elapsed_s(joint, now)
        self._lead[joint] = clamped(ahead, 0.0, SLACK_SAMPLES / self.rate)
        self._pace[joint] = (reference - self.sent[joint]) / max(
            now - self.sent_at[joint], 1.0 / self.rate
        )
        self.sent[joint] = self.base[joint] = reference
        self.sent_at[joint], self._speed[joint] = now, speed
        self._unheard[joint] += 1
        self._goes_on_since[joint] = None
        return reference


def _reason(error: BaseException) -> str:
    """Return in words why a run is stopped."""
    if isinstance(error, DeviceError):
        return str(error)
    if isinstance(error, KeyboardInterrupt):
        return "stopped by Ctrl-C"
    if isinstance(error, SystemExit | CancelledError):
        return "stopped by the program that called exoid"
    return f"a fault of exoid's own ({error!r})"
