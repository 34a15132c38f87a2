"""The samples of one drive, each checked against the one before it.

The answers to exchanges are one stream, the drive's own record another; both are checked alike. No
checksum guards against a wrong device, gateway or register map. So contradictions are looked for:
with the limits, between counter and clock, angle and velocity, a value and the motion that was
sent. An error that contradicts nothing passes; docs/faults.md says how large it can be.
"""

from math import ceil

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.safety.clock_check import ClockCheck
from pipelines.acquisition.safety.limits import sample_violation
from pipelines.acquisition.safety.set_point_history import SetPointHistory
from pipelines.acquisition.safety.stuck_register import StuckRegisters
from pipelines.acquisition.safety.watchdog import Watchdog
from pipelines.errors import DeviceError, Unanswered
from pipelines.settings.rig import RigSettings


class SampleStream:
    """The samples of one drive so far; instants ``now`` are the host's, s."""

    def __init__(
        self, rig: RigSettings, joint: int, sample_rate_hz: float, history: SetPointHistory
    ) -> None:
        """Check the samples of a joint's drive, whose set-points are in ``history``."""
        self._drive = rig.drive[joint]
        self._label = rig.label_of(self._drive)
        self._cycle = rig.samples_per_cycle(sample_rate_hz)
        self._cycle_hz, self._rate = sample_rate_hz, sample_rate_hz * self._cycle
        self._watchdog = Watchdog(rig.safety.watchdog_s)
        # What comes within the watchdog's time, and one cycle more.
        self._most = self._cycle * (1 + ceil(rig.safety.watchdog_s * sample_rate_hz))
        ring = rig.map.drive[self._drive.map].ring
        # Records that fill one read wait for it.
        self._waiting = ring.records_per_read if ring else 0
        self._history = history
        self._clock = ClockCheck(self._label, self._cycle, self._rate)
        self._registers = StuckRegisters(self._label, self._cycle, self._rate, history)
        self._settle_s = rig.safety.settle_s
        self._left_out: tuple[int, int] | None = None
        """Samples between which the drive was sent nothing last: samples were missed, or set-points
        left out."""
        self._last: Reading | None = None
        self._newest_at_first: int | None = None
        self._unanswered: Unanswered | None = None

    def begin(self, reading: Reading, now: float) -> None:
        """Begin with a sample."""
        self._last = reading
        self._clock.begin(reading)
        self._watchdog.reset(now)

    def miss(self, error: Unanswered) -> None:
        """Note that the drive did not answer."""
        self._unanswered = error

    def refuse_silence(self, now: float) -> None:
        """Refuse to go on where no new sample has come for too long."""
        if not self._watchdog.has_expired(now):
            return
        if self._unanswered:
            raise self._unanswered
        raise DeviceError(
            f"watchdog: no new sample from {self._label} for {self._watchdog.waited(now):.3f} s,"
            f" allowed are {self._watchdog.longest_s:g} s (safety.watchdog_s): its counter stands"
            " still or its answers are late; check the drive and its line, and end other programs"
            " on this computer"
        )

    def refuse_to_fall_behind(self, newest: int) -> None:
        """Refuse to go on where the drive's own record does not keep up with its counter, which is
        at ``newest``."""
        if self._newest_at_first is None:
            self._newest_at_first = newest
        last = self._newest_at_first if self._last is None else self._last.sequence
        if newest - last > self._most + self._waiting:
            raise DeviceError(
                f"watchdog: {self._label} is at sample {newest}, but its record brought none after"
                f" {last}, allowed are {self._watchdog.longest_s:g} s; the record stands still, its"
                " answers are lost, its registers are not those in map.drive's ring, or this"
                " computer is too busy"
            )

    def refuse_count(self, count: int) -> None:
        """Refuse a counter that runs backwards or leaps."""
        if self._last is None:
            return
        last = self._last.sequence
        if count < last:
            raise DeviceError(
                f"{self._label}: its sample counter went back from {last} to {count}; was it"
                " restarted?"
            )
        if count > last + self._most:
            raise DeviceError(
                f"{self._label}: its sample counter leapt from {last} to {count}, expected at most"
                f" {self._most} samples within the watchdog's {self._watchdog.longest_s:g} s; was"
                " it restarted?"
            )

    def check(self, reading: Reading, now: float) -> bool:
        """Return whether a sample is new; raise DeviceError where it is reason to stop."""
        self._unanswered = None
        self.refuse_count(reading.sequence)
        before = self._last or reading
        if self._last is None:
            self.begin(reading, now)
        elif reading.sequence == before.sequence:
            return False
        # One more or less than a cycle is the host's doing.
        if reading.sequence - before.sequence >= 2 * self._cycle:
            self.leave_out(before.sequence, reading.sequence)
        for check in (
            self._clock.check_rate,
            self._limit,
            self._clock.check_step,
            self._leap,
            self._echo,
            self._registers.check,
        ):
            reason = check(before, reading)
            if reason:
                raise DeviceError(reason)
        self._last = reading
        self._watchdog.reset(now)
        return True

    def limit_violation(self, reading: Reading) -> str | None:
        """Return which limit a sample breaks that is outside the stream, next to its newest one."""
        return sample_violation(self._drive, self._last or reading, reading, self._rate)

    def _leap(self, before: Reading, reading: Reading) -> str | None:
        """Check an angle against the one before it, the speed limit and the measured velocity."""
        # How far a drive's speed may be from its angle's change, as a share of the speed limit.
        speed_share = 0.25
        samples = reading.sequence - before.sequence
        if samples <= 0:
            return None
        seconds, limit = samples / self._rate, self._drive.speed_rad_s
        speed = (reading.angle - before.angle) / seconds
        if not abs(speed) <= limit:
            return (
                f"{self._label}: its angle leapt from {before.angle:.4f} to {reading.angle:.4f} rad"
                f" within {seconds:.4f} s, faster than its limit of {limit:g} rad/s;"
                f" {self._or_else(reading)}check the encoder, or the word order in the rig file"
            )
        # The mean of both speeds is the speed in between only from one sample to the next.
        measured = 0.5 * (before.velocity + reading.velocity)
        if samples == 1 and abs(speed - measured) > speed_share * limit:
            # Of equal size but opposite sign: most likely a sign in the rig file, not the encoder.
            mirrored = abs(speed + measured) < speed_share * abs(speed)
            turn = "turn the sign of one of the two, or " if mirrored else ""
            return (
                f"{self._label}: its angle went on at {speed:.3f} rad/s, but it reports a speed of"
                f" {measured:.3f} rad/s; {self._or_else(reading)}{turn}check"
                " the encoder, or the registers of angle and velocity in the rig file"
            )
        return None

    def leave_out(self, since: int, until: int) -> None:
        """Note that the drive was sent nothing between two samples."""
        self._left_out = since, until

    def after_jerk(self, why: str, reading: Reading | None = None) -> str:
        """Return a reason to stop, with a possible jerk of the leg shortly before a sample."""
        jerked = self._jerked(reading or self._last)
        return f"{why}; {jerked}" if jerked else why

    def _limit(self, before: Reading, reading: Reading) -> str | None:
        why = sample_violation(self._drive, before, reading, self._rate)
        return why and self.after_jerk(why, reading)

    def _or_else(self, reading: Reading) -> str:
        jerked = self._jerked(reading)
        return f"{jerked}; else " if jerked else ""

    def _jerked(self, reading: Reading | None) -> str:
        """Return that the leg may have jerked, where its drive was sent nothing shortly before."""
        if self._left_out is None or reading is None or reading.sequence < self._left_out[0]:
            return ""
        seconds = max(reading.sequence - self._left_out[1], 0) / self._rate
        if seconds > self._settle_s:
            return ""
        when = f"{seconds:.3f} s before it" if seconds else "before it"
        return (
            f"samples or set-points were missed {when}, which may jerk a leg: see why answers are"
            " lost or late, or make the motion slower"
        )

    def _echo(self, before: Reading, reading: Reading) -> str | None:
        """Check the set-point that the drive reports against the one that was sent."""
        # How far a drive's set-point may be from the sent one, in cycles at the speed limit.
        echo_cycles = 8
        sent = self._history.at(reading.sequence).reference
        cycles = echo_cycles + (reading.sequence - before.sequence) / self._cycle
        # NaN where the drive does not report it.
        if not abs(reading.reference - sent) > cycles * self._drive.speed_rad_s / self._cycle_hz:
            return None
        return (
            f"{self._label}: follows a set-point of {reading.reference:.4f} rad, but was sent"
            f" {sent:.4f} rad; check the register of reference in the rig file, or what else writes"
            " to the drive"
        )
