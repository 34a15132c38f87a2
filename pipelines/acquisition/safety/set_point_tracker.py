"""The set-points of one drive: the last one sent, and how the next one may go on from it.

A tracker neither waits nor sends. It refuses a set-point that no planned motion may ask for, and
knows when a drive that was sent nothing for a while must be asked where it is.
"""

from math import isnan

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.modbus.wraparound import RATE_TOLERANCE
from pipelines.acquisition.safety.limits import clamped, refuse_leap, slowed
from pipelines.acquisition.safety.return_to_plan import NO_LAG_RAD, Path, step_to_plan
from pipelines.settings.rig import RigSettings

SLACK_SAMPLES = 2
"""Samples by which set-points may be ahead of the speed limit, as the host sees samples late."""
DRIFT = 0.01
"""Share of a cycle by which drives' clocks may part in one: far more than any two do."""


class SetPointTracker:
    """The last set-point of one drive, and the range of the next one."""

    def __init__(self, rig: RigSettings, joint: int, sample_rate_hz: float) -> None:
        """Track the set-points of a joint's drive; angles are rad, instants the host's clock, s."""
        self.drive = rig.drive[joint]
        self._safety, self._rate = rig.safety, sample_rate_hz
        self._samples_per_cycle = rig.samples_per_cycle(sample_rate_hz)
        self._in_lockstep = rig.clock == "lockstep"
        drive_map = rig.map.drive[self.drive.map]
        self._reports_reference = drive_map.read.reference is not None
        self.resolution = max(drive_map.write.reference.step, NO_LAG_RAD)
        """Difference below which two set-points are the same to the drive, rad."""
        self.sent = 0.0
        """The last set-point; to begin with, where the leg stands."""
        self.base = 0.0
        """Where the next one steps from: the last one, or where the drive is after a silence."""
        self.in_force = 0.0
        """The set-point that is reached at the sample latched when the last one is sent."""
        self.sent_at = 0.0
        self.counter_lead = 0.0
        """Samples by which the drive's counter leads the machine's cycles as set-points come."""
        self._speed = 0.0
        """Speed of the set-points, rad/s, at which a stop or the way back to the plan begins."""
        self._drift_speed = 0.0
        """rad/s at which the drive may go on by itself, as from its last two set-points."""
        self._answered_at = 0.0
        self._unanswered = 0
        """Set-points since the drive answered last."""
        self._moving_since: float | None = None
        """Cycle in which a drive that goes on by itself was at ``base``; None for others."""
        self._slack_used = 0.0
        """By how much the set-points are ahead of the speed limit, s."""

    def start_at(self, angle: float) -> None:
        """Begin where the leg stands."""
        self.sent = self.base = angle

    def begin(self, reading: Reading, cycle: int, now: float) -> None:
        """Begin to follow the plan at the first sample of an enabled drive."""
        self.counter_lead = float(reading.sequence - cycle * self._samples_per_cycle)
        self._answered_at = now

    def mark_answered(self, at: float) -> None:
        """Note an answer: set-points sent before it have arrived."""
        if at > self._answered_at:
            self._answered_at, self._unanswered = at, 0

    def is_stale(self, now: float) -> bool:
        """Return whether the last answer is too old to know which set-points the drive follows.

        In lockstep a drive holds the last one that arrived, however long, and those that did not
        add up to a leap.
        """
        if self._drift_speed == 0.0:  # one that is held has nowhere to go on to
            return False
        if self._in_lockstep:
            return self._unanswered >= SLACK_SAMPLES
        return now - self._answered_at > SLACK_SAMPLES / self._rate

    def resume(self, reading: Reading, now: float) -> None:
        """Go on from where the drive is after a silence, in which some hold and others move on."""
        self.mark_answered(now)
        silent_s, drift = now - self.sent_at, self._drift_speed
        if self._reports_reference:
            # A report counts only as far as the speed limit leads in the silence.
            reach = self.drive.speed_rad_s * silent_s
            place = clamped(reading.reference, self.sent - reach, self.sent + reach)
        else:  # the leg lags behind a drive that holds, and is ahead with one that moves on
            ahead = self.sent + drift * silent_s
            place = clamped(reading.angle, *sorted((self.sent, ahead)))
        speed = reading.velocity
        if isnan(speed):
            speed = (place - self.sent) / silent_s if silent_s else 0.0
        # By more than a count, in the direction in which its set-points were moving.
        moves_on = (place - self.sent) * drift > self.resolution * abs(drift)
        self.base = self.in_force = place
        self._speed = clamped(speed, *sorted((0.0, self._speed)))
        cycle = (reading.sequence - self.counter_lead) / self._samples_per_cycle
        self._moving_since = cycle if moves_on and not self._in_lockstep else None

    def meet(self, reading: Reading, cycle: int) -> None:
        """Note how far the drive's counter was ahead when its set-point came.

        The least counts, for a set-point may come late. It may grow slowly, as clocks drift apart.
        """
        ahead = float(reading.sequence - cycle * self._samples_per_cycle)
        self.counter_lead = min(self.counter_lead + DRIFT * self._samples_per_cycle, ahead)

    def repeat(self, now: float) -> float:
        """Return the next set-point where no new sample came: the base again."""
        return self.follow(self.base, self._speed, now)

    def follow(self, reference: float, speed: float, now: float) -> float:
        """Return a set-point of the plan or of the way back; refuse one beyond the limits."""
        refuse_leap(self.drive, self.base, reference, 1.0 / self._rate)
        refuse_leap(self.drive, self.sent, reference, self._allowed_s(now))
        self.in_force = self.base
        return self._send(reference, speed, now)

    def follow_plan(self, path: Path, cycle: int, now: float) -> float:
        """Return the set-point towards the plan that is due at a cycle.

        Raises
        ------
        DeviceError
            The plan leaps there or leaves its limits, or is too far ahead.
        """
        return self.follow(*self._towards(path, cycle, now), now)

    def hold_to_plan(self, path: Path, cycle: int, now: float) -> float:
        """Return the set-point towards the plan, within the limits, while others are awaited."""
        return self._send_limited(*self._towards(path, cycle, now), now)

    def slow_down(self, now: float) -> float:
        """Return the set-point that slows the drive down, a sample after its last one."""
        deceleration = self._safety.deceleration_rad_s2
        path, speed = slowed(self.base, self._speed, deceleration, 1.0 / self._rate)
        return self._send_limited(path, speed, now)

    def _towards(self, path: Path, cycle: int, now: float) -> tuple[float, float]:
        """Return a set-point along the plan, or on the way back to it, and its speed, rad/s."""
        # The plan itself must not leap between two cycles, or leave its limits.
        due, before, _ = path
        refuse_leap(self.drive, before, due, 1.0 / self._rate)
        self._move_base_on(cycle)
        took_s = min(self._elapsed_s(now), 1.0 / self._rate)
        return step_to_plan(
            self.drive, self._safety, path, self.base, self._speed, took_s, self._rate
        )

    def _move_base_on(self, cycle: int) -> None:
        """Move the base of a drive that goes on by itself, if it was asked within a cycle."""
        since = self._moving_since
        # Asked longer ago than a sample, the drive may have done anything since.
        if since is not None and abs(cycle - since) <= 1.0:
            self.base += self._speed * (cycle - since) / self._rate
            self.in_force = self.base

    def _send_limited(self, path: float, speed: float, now: float) -> float:
        """Return a set-point as near to ``path`` as the limits allow by now."""
        reach = self.drive.speed_rad_s * self._allowed_s(now)
        within_reach = clamped(path, self.sent - reach, self.sent + reach)
        reference = clamped(within_reach, *self.drive.angle_rad)
        refuse_leap(self.drive, self.base, reference, 1.0 / self._rate)
        return self._send(reference, speed, now)

    def _elapsed_s(self, now: float) -> float:
        """Return the time since the last set-point, s."""
        # Not by the drive's counter: one that runs too fast does not make time go by.
        if self._in_lockstep:
            return 1.0 / self._rate
        # A drive's clock may be faster than the host's by as much.
        return (now - self.sent_at) * (1.0 + RATE_TOLERANCE)

    def _allowed_s(self, now: float) -> float:
        """Return how long the speed limit may have led from the last set-point, s."""
        return self._elapsed_s(now) + SLACK_SAMPLES / self._rate - self._slack_used

    def _send(self, reference: float, speed: float, now: float) -> float:
        """Note the set-point that the drive is sent now and its speed, rad/s; return it."""
        # Time that a step takes beyond what has passed is borrowed, up to two samples, and paid
        # back.
        step, elapsed_s = reference - self.sent, self._elapsed_s(now)
        ahead = self._slack_used + abs(step) / self.drive.speed_rad_s - elapsed_s
        self._slack_used = clamped(ahead, 0.0, SLACK_SAMPLES / self._rate)
        self._drift_speed = step / max(now - self.sent_at, 1.0 / self._rate)
        self.sent = self.base = reference
        self.sent_at, self._speed = now, speed
        self._unanswered += 1
        self._moving_since = None
        return reference
