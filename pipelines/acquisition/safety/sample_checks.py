"""One drive's samples, one after the other: whether they keep coming, and whether each can be true
after the last.

What exchanges bring is one stream, what the drive recorded itself another; both are judged alike.
No checksum guards what a device, a gateway or a register map got wrong, so contradictions are
looked for: with the limits, between a counter and its clock, between an angle and its speed,
between a value and the motion that was asked for. What contradicts nothing passes; docs/faults.md
says how large it can be.
"""

from math import ceil, inf

from pipelines.acquisition.machine.drive import Reading
from pipelines.acquisition.modbus.wraparound import RATE_TOLERANCE, keeps_time
from pipelines.acquisition.safety.limits import sample_violation
from pipelines.acquisition.safety.stuck_register import (
    ANSWER_CYCLES,
    FROZEN_CYCLES,
    FROZEN_RAD,
    Held,
    Told,
)
from pipelines.acquisition.safety.watchdog import Patience
from pipelines.errors import DeviceError, Unanswered
from pipelines.settings.rig import MOST_REGISTERS, RigSettings

SETTLED_CYCLES = 50
"""Cycles after which a clock's rate is looked at; a step of it can then be told from a wrong
unit."""
SPEED_SHARE = 0.25
"""How far a drive's speed may be from what its angle does in one sample, as a share of the speed
limit."""
ECHO_CYCLES = 8
"""Within how many cycles at the speed limit a drive's set-point must be of the one that was
sent."""
CHANGING = {"angle": "rad", "velocity": "rad/s", "current": "A"}
"""What a drive tells that changes while its joint moves."""


class Stream:
    """What one drive told so far, against which its next sample is held; instants ``now`` are the
    host's, s."""

    def __init__(self, rig: RigSettings, joint: int, sample_rate_hz: float, told: Told) -> None:
        """Judge the samples of a joint's drive, which is ``told`` set-points at a rate."""
        self._drive = rig.drive[joint]
        self._label = rig.label_of(self._drive)
        self._cycle = rig.samples_per_cycle(sample_rate_hz)
        self._cycle_hz, self._rate = sample_rate_hz, sample_rate_hz * self._cycle
        self._patience = Patience(rig.safety.watchdog_s)
        self._most = self._cycle * (1 + ceil(rig.safety.watchdog_s * sample_rate_hz))
        self._told = told
        self._held = {name: Held() for name in CHANGING}
        self._gone = 0.0
        self._settle_s = rig.safety.settle_s
        self._untold: tuple[int, int] | None = None
        """Between which samples the drive was told nothing last, for samples were missed or
        set-points left out."""
        self._first: Reading | None = None
        self._last: Reading | None = None
        self._newest_at_first: int | None = None
        self._unanswered: Unanswered | None = None

    def begin(self, found: Reading, now: float) -> None:
        """Begin with a sample."""
        self._first = self._last = found
        self._patience.hear(now)

    def miss(self, error: Unanswered) -> None:
        """Note that the drive did not answer."""
        self._unanswered = error

    def refuse_silence(self, now: float) -> None:
        """Refuse to go on where no new sample has come for too long."""
        if not self._patience.is_over(now):
            return
        if self._unanswered:
            raise self._unanswered
        raise DeviceError(
            f"watchdog: no new sample from {self._label} for {self._patience.waited(now):.3f} s,"
            f" allowed are {self._patience.longest_s:g} s; its counter stands still, its answers"
            " are lost, or this computer is too busy"
        )

    def refuse_to_fall_behind(self, newest: int) -> None:
        """Refuse to go on where the drive's own record does not keep up with its counter, which is
        at ``newest``."""
        if self._newest_at_first is None:
            self._newest_at_first = newest
        last = self._newest_at_first if self._last is None else self._last.sequence
        # What fills one read waits for it.
        if newest - last > self._most + MOST_REGISTERS["read"]:
            raise DeviceError(
                f"watchdog: {self._label} is at sample {newest}, but its record brought none after"
                f" {last}, allowed are {self._patience.longest_s:g} s; the record stands still, its"
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
                f" {self._most} samples within the watchdog's {self._patience.longest_s:g} s; was"
                " it restarted?"
            )

    def take(self, found: Reading, now: float) -> bool:
        """Tell whether a sample is a new one; raise DeviceError where it is reason to stop."""
        self._unanswered = None
        self.refuse_count(found.sequence)
        before = self._last or found
        if self._first is None:
            self.begin(found, now)
        elif found.sequence == before.sequence:
            return False
        # One more or less than a cycle is the host's doing.
        if found.sequence - before.sequence >= 2 * self._cycle:
            self.leave_out(before.sequence, found.sequence)
        why = (
            self._clock(before, found)
            or self._broken_limit(before, found)
            or self._step(before, found)
            or self._leap(before, found)
            or self._echo(before, found)
            or self._frozen(before, found)
        )
        if why:
            raise DeviceError(why)
        self._last = found
        self._patience.hear(now)
        return True

    def _settled(self, found: Reading) -> int:
        """Return how many samples the rate can be told from; 0 while they are too few."""
        assert self._first is not None  # begun
        samples = found.sequence - self._first.sequence
        return samples if samples >= SETTLED_CYCLES * self._cycle else 0

    def _clock(self, before: Reading, found: Reading) -> str | None:
        """Return what is wrong with a clock that does not go on, or not at the rate: its unit may
        be another."""
        if found is not before and not found.time > before.time:
            return (
                f"{self._label}: its clock went from {before.time:.6f} to {found.time:.6f} s while"
                f" its counter went from {before.sequence} to {found.sequence}; was it restarted?"
            )
        if not (samples := self._settled(found)):
            return None
        assert self._first is not None  # begun
        rate = samples / max(found.time - self._first.time, 1e-9)
        if abs(rate / self._rate - 1.0) <= RATE_TOLERANCE:
            return None
        return (
            f"{self._label}: samples {rate:.4g} times a second by its own clock, expected"
            f" {self._rate:g}; correct acquire.sample_rate_hz, or the unit of time in the rig file"
        )

    def _step(self, before: Reading, found: Reading) -> str | None:
        """Hold the clock against the counter from one sample to the next."""
        samples, seconds = found.sequence - before.sequence, found.time - before.time
        if not self._settled(found) or keeps_time(samples, seconds, self._rate):
            return None
        return (
            f"{self._label}: its clock went on by {seconds:.6f} s while its counter went on by"
            f" {samples} samples of {1 / self._rate:.6f} s; one of the two leapt: was it restarted,"
            " or is its answer damaged?"
        )

    def _leap(self, before: Reading, found: Reading) -> str | None:
        """Hold an angle against the one before it, the speed limit, and the speed that the drive
        tells."""
        samples = found.sequence - before.sequence
        if samples <= 0:
            return None
        seconds, limit = samples / self._rate, self._drive.speed_rad_s
        speed = (found.angle - before.angle) / seconds
        if not abs(speed) <= limit:
            return (
                f"{self._label}: its angle leapt from {before.angle:.4f} to {found.angle:.4f} rad"
                f" within {seconds:.4f} s, faster than its limit of {limit:g} rad/s;"
                f" {self._or_else(found)}check the encoder, or the word order in the rig file"
            )
        told = 0.5 * (before.velocity + found.velocity)
        if samples == 1 and abs(speed - told) > SPEED_SHARE * limit:
            mirrored = abs(speed + told) < SPEED_SHARE * abs(speed)
            turn = "turn the sign of one of the two, or " if mirrored else ""
            return (
                f"{self._label}: its angle went on at {speed:.3f} rad/s while it told a speed of"
                f" {told:.3f} rad/s; {self._or_else(found)}{turn}check"
                " the encoder, or the registers of angle and velocity in the rig file"
            )
        return None

    def leave_out(self, since: int, until: int) -> None:
        """Note that the drive was told nothing between two samples."""
        self._untold = since, until

    def after_jerk(self, why: str, found: Reading | None = None) -> str:
        """Return why to stop, with what may have jerked the leg shortly before the sample that was
        found."""
        jerked = self._jerked(found or self._last)
        return f"{why}; {jerked}" if jerked else why

    def _broken_limit(self, before: Reading, found: Reading) -> str | None:
        why = sample_violation(self._drive, before, found, self._rate)
        return why and self.after_jerk(why, found)

    def _or_else(self, found: Reading) -> str:
        jerked = self._jerked(found)
        return f"{jerked}; else " if jerked else ""

    def _jerked(self, found: Reading | None) -> str:
        """Return in words that the leg may have jerked, where its drive was told nothing shortly
        before; or nothing."""
        if self._untold is None or found is None or found.sequence < self._untold[0]:
            return ""
        seconds = max(found.sequence - self._untold[1], 0) / self._rate
        if seconds > self._settle_s:
            return ""
        when = f"{seconds:.3f} s before it" if seconds else "before it"
        return (
            f"samples or set-points were missed {when}, which may jerk a leg: see why answers are"
            " lost or late, or make the motion slower"
        )

    def _echo(self, before: Reading, found: Reading) -> str | None:
        """Hold the set-point that is in force against the one that was sent."""
        sent = self._told.at(found.sequence).reference
        cycles = ECHO_CYCLES + (found.sequence - before.sequence) / self._cycle
        # NaN where the drive does not tell and it is not known.
        if not abs(found.reference - sent) > cycles * self._drive.speed_rad_s / self._cycle_hz:
            return None
        return (
            f"{self._label}: follows a set-point of {found.reference:.4f} rad, but was sent"
            f" {sent:.4f} rad; check the register of reference in the rig file, or what else writes"
            " to the drive"
        )

    def _frozen(self, before: Reading, found: Reading) -> str | None:
        """Tell which register stands still while the joint is told to move, and moves by what else
        is known of it."""
        travel = self._told.at(found.sequence - ANSWER_CYCLES * self._cycle).travel
        self._gone += found.velocity * (found.sequence - before.sequence) / self._rate
        for name, unit in CHANGING.items():
            held = self._held[name]
            held.tell(getattr(found, name), found.sequence, travel, self._gone, found.angle)
            samples, went = found.sequence - held.since, travel - held.travel
            if samples < FROZEN_CYCLES * self._cycle or went <= FROZEN_RAD:
                continue
            seconds = samples / self._rate
            # NaN: nothing else is known.
            if not self._contradicted(name, held, found, seconds) <= FROZEN_RAD:
                return (
                    f"{self._label}: tells {name} {held.value:.6g} {unit} for {seconds:.3f} s,"
                    f" while it was told to go {went:.3f} rad; its register is frozen, or the joint"
                    " is blocked"
                )
        return None

    def _contradicted(self, name: str, held: Held, found: Reading, seconds: float) -> float:
        """Return by how much angle or speed contradict a value that stood still, rad; of a current
        nothing is known."""
        if name == "angle":
            return abs(self._gone - held.gone)
        if name == "velocity" and found.angle == held.angle and found.velocity != 0.0:
            return inf  # one that stands has no speed
        if name == "velocity":
            return abs(found.angle - held.angle - found.velocity * seconds)
        return inf
