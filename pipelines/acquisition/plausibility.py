"""Whether what the devices tell can be true: no checksum guards what a device, a gateway or a register map got wrong.

Only contradictions are found: with the speed limits, between a counter and its clock, between an angle and its
speed, between a value and the motion that was asked for. What contradicts nothing passes; docs/faults.md says how
large it can be.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine import Reading, Row
from pipelines.mechanics.motion import CUFFS
from pipelines.settings.rig import DriveSettings, RigSettings

SETTLED_SAMPLES = 50
"""Samples after which a clock's rate is known to be right, so that a step in it can be told from a wrong unit."""
CLOCK_SAMPLES = 0.5
"""How far a clock may be from its counter between two samples, in samples, and a share of what lies between."""
CLOCK_SHARE = 0.05
SPEED_SHARE = 0.25
"""How far a drive's speed may be from what its angle does in one sample, as a share of the speed limit."""
ECHO_SAMPLES = 8
"""Within how many samples at the speed limit a drive's set-point must be of the one that was sent last."""
FROZEN_RAD, FROZEN_SAMPLES = 0.03, 10
"""How far a joint is told to go, and in how many samples, before a value that never changed is taken for frozen."""
LEAST_FORCE_N = 1e-6
"""No sensor resolves less; a float whose words are swapped often is."""
REGISTERS = {"angle": "rad", "velocity": "rad/s", "current": "A"}
"""What a drive tells that changes while its joint moves."""


@dataclass
class Held:
    """A value that is told again and again, and how long nothing else was."""

    value: object = None
    samples: int = 0
    travel: NDArray = field(default_factory=lambda: np.zeros(1))
    """(J,) how far the joints were told to go meanwhile, rad."""

    def tell(self, value: object, samples: int, travel: NDArray) -> None:
        """Take the value of a sample, so many samples and so much travel after the last one."""
        same = value == self.value
        self.samples, self.travel = (self.samples + samples, self.travel + travel) if same else (0, 0.0 * travel)
        self.value = value

    def is_frozen(self, travel: float) -> bool:
        """Tell whether the value should have changed while a joint was told to go so far, rad."""
        return self.samples >= FROZEN_SAMPLES and travel > FROZEN_RAD


class Plausibility:
    """What was told so far, against which the next sample is held."""

    def __init__(self, rig: RigSettings, sample_rate_hz: float) -> None:
        self._rig = rig
        self._rate = sample_rate_hz
        self._drives_hz = sample_rate_hz * rig.samples_per_cycle(sample_rate_hz)
        self._last: Row | None = None
        self._first = 0
        self._sent: NDArray | None = None
        self._held: dict[tuple[int, str], Held] = {}

    def doubt(self, row: Row, sent: NDArray) -> str | None:
        """Return why a new sample cannot be true, None if it can; ``sent`` are the last set-points (J,) rad."""
        last, self._last = self._last, row
        travel = np.zeros_like(sent) if self._sent is None else np.abs(sent - self._sent)
        self._sent = sent.copy()
        if last is None:
            self._first = row.sequence
            return None
        samples = row.sequence - last.sequence
        for j, drive in enumerate(self._rig.drive):
            before, found = last.drives[j], row.drives[j]
            why = (
                self._clock(drive, before, found, row.sequence)
                or self._leap(drive, before, found)
                or self._echo(drive, found, samples, float(sent[j]))
                or self._frozen(j, found, samples, travel)
            )
            if why:
                return f"{self._rig.label_of(drive)}: {why}"
        return self._cuffs(row.forces, samples, travel)

    def _clock(self, drive: DriveSettings, before: Reading, found: Reading, sequence: int) -> str | None:
        """Hold a drive's clock against its counter."""
        samples, seconds = found.sequence - before.sequence, found.time - before.time
        allowed = CLOCK_SAMPLES + CLOCK_SHARE * abs(samples)
        if sequence - self._first < SETTLED_SAMPLES or abs(seconds * self._drives_hz - samples) <= allowed:
            return None
        return (
            f"its clock went on by {seconds:.6f} s while its counter went on by {samples} samples of "
            f"{1 / self._drives_hz:.6f} s; one of the two leapt: was it restarted, or is its answer damaged?"
        )

    def _leap(self, drive: DriveSettings, before: Reading, found: Reading) -> str | None:
        """Hold an angle against the one before it, the speed limit, and the speed that the drive tells."""
        seconds = (found.sequence - before.sequence) / self._drives_hz
        if seconds <= 0.0:
            return None
        speed = (found.angle - before.angle) / seconds
        if not abs(speed) <= drive.speed_rad_s:
            return (
                f"its angle leapt from {before.angle:.4f} to {found.angle:.4f} rad within {seconds:.4f} s, faster than "
                f"its limit of {drive.speed_rad_s:g} rad/s; check the encoder, or the word order in the rig file"
            )
        told = 0.5 * (before.velocity + found.velocity)
        if seconds * self._drives_hz < 1.5 and abs(speed - told) > SPEED_SHARE * drive.speed_rad_s:
            return (
                f"its angle went on at {speed:.3f} rad/s while it told a speed of {told:.3f} rad/s; check the encoder, "
                "or the registers of angle and velocity in the rig file"
            )
        return None

    def _echo(self, drive: DriveSettings, found: Reading, samples: int, sent: float) -> str | None:
        """Hold the set-point that is in force against the one that was sent."""
        allowed = (ECHO_SAMPLES + samples) * drive.speed_rad_s / self._rate
        if not abs(found.reference - sent) > allowed:  # NaN where the drive does not tell and it is not known
            return None
        return (
            f"follows a set-point of {found.reference:.4f} rad, but was sent {sent:.4f} rad; check the register of "
            "reference in the rig file, or what else writes to the drive"
        )

    def _frozen(self, j: int, found: Reading, samples: int, travel: NDArray) -> str | None:
        """Tell which register stands still while the joint is told to move."""
        for name, unit in REGISTERS.items():
            value = getattr(found, name)
            held = self._held.setdefault((j, name), Held())
            held.tell(value, samples, travel)
            if held.is_frozen(held.travel[j]):
                return (
                    f"tells {name} {value:.6g} {unit} for {held.samples / self._rate:.3f} s, while it was told to "
                    f"go {held.travel[j]:.3f} rad; its register is frozen, or the joint is blocked"
                )
        return None

    def _cuffs(self, forces: NDArray, samples: int, travel: NDArray) -> str | None:
        """Hold each cuff's forces (4, 3) N against what a sensor can tell, and against the motion."""
        for force, name in zip(forces, CUFFS, strict=True):
            held = self._held.setdefault((-1, name), Held())
            # A sensor that was not read tells what it told.
            held.tell(held.value if np.isnan(force).any() else tuple(force.tolist()), samples, travel)
            if ((np.abs(force) < LEAST_FORCE_N) & (force != 0.0)).any():
                return (
                    f"sensor {name}: tells forces of {_three(force)} N, smaller than any sensor resolves; check the "
                    "word order in the rig file"
                )
            if held.value is not None and held.is_frozen(held.travel.max()) and not np.isnan(force).any():
                return (
                    f"sensor {name}: counts on, but tells forces of {_three(force)} N for "
                    f"{held.samples / self._rate:.3f} s while the leg was told to move; its registers are frozen"
                )
        return None


def _three(force: Sequence[float] | NDArray) -> str:
    return ", ".join(f"{value:.3g}" for value in force)
