"""Whether samples keep coming, and the machine's counter and clock go on as they should."""

from math import ceil
from typing import Protocol

from pipelines.errors import DeviceError
from pipelines.settings.rig import RigSettings

RATE_SAMPLES = 50
RATE_TOLERANCE = 0.05
"""How far the devices' clock may be from the rate that was asked for, and after how many samples that is looked at."""


class Told(Protocol):
    """A sample, or a row of them."""

    @property
    def sequence(self) -> int:
        """The counter."""

    @property
    def time(self) -> float:
        """The device's clock, s."""


class Watch:
    """One drive's counter and clock, the first one's are the machine's; times ``now`` are the host's, s."""

    def __init__(self, rig: RigSettings, sample_rate_hz: float, joint: int = 0) -> None:
        self._label = rig.label_of(rig.drive[joint])
        self._rate = sample_rate_hz
        self._longest_s = rig.safety.watchdog_s
        self._most = 1 + ceil(self._longest_s * sample_rate_hz)

    def begin(self, row: Told, now: float) -> None:
        """Begin with a sample."""
        self._first = self._last = row
        self._fresh = now

    def look(self, found: int, now: float) -> None:
        """Refuse to go on after too long a wait, or with a counter that runs backwards or leaps."""
        waited, last = now - self._fresh, self._last.sequence
        if waited > self._longest_s:
            raise DeviceError(
                f"watchdog: no new sample from {self._label} for {waited:.3f} s, allowed are {self._longest_s:g} s; "
                "its counter stands still, its answers are lost, or this computer is too busy"
            )
        if found < last:
            raise DeviceError(f"{self._label}: its sample counter went back from {last} to {found}; was it restarted?")
        if found > last + self._most:
            raise DeviceError(
                f"{self._label}: its sample counter leapt from {last} to {found}, expected at most {self._most} "
                f"samples within the watchdog's {self._longest_s:g} s; was it restarted?"
            )

    def take(self, row: Told, now: float) -> bool:
        """Tell whether a sample is a new one; refuse one that does not go on from the last."""
        self.look(row.sequence, now)
        if row.sequence == self._last.sequence:
            return False
        self._check_clock(row)
        if row.sequence - self._first.sequence >= RATE_SAMPLES:
            self._check_rate(row)
        self._last, self._fresh = row, now
        return True

    def _check_clock(self, row: Told) -> None:
        """Refuse a device clock that does not go on with the samples."""
        if not row.time > self._last.time:
            raise DeviceError(
                f"{self._label}: its clock went from {self._last.time:.6f} to {row.time:.6f} s while its counter went "
                f"from {self._last.sequence} to {row.sequence}; was it restarted?"
            )

    def _check_rate(self, row: Told) -> None:
        """Refuse a device clock that does not tell the sample rate; a wrong unit in the rig file shows here."""
        found = (row.sequence - self._first.sequence) / max(row.time - self._first.time, 1e-9)
        if not abs(found / self._rate - 1.0) <= RATE_TOLERANCE:
            raise DeviceError(
                f"{self._label}: samples {found:.4g} times a second by its own clock, expected {self._rate:g}; "
                "correct acquire.sample_rate_hz, or the unit of time in the rig file"
            )
