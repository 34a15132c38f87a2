"""Whether a device's counter and clock go on as this computer's clock does.

A reply with another device's values, or of a device that was restarted, shows in them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from pipelines.acquisition.modbus.wraparound import RATE_TOLERANCE, unwrap
from pipelines.errors import DeviceError
from pipelines.modbus.register_block import Block


@dataclass(frozen=True)
class Instant:
    """Counter and clock (s) of a sample, and when it was asked for and had come, s."""

    sequence: int
    time: float | None
    asked: float
    answered: float


class Progress:
    """The counter and clock of one device since its first sample."""

    def __init__(self, label: str, block: Block, rate_hz: float) -> None:
        """Follow a device with a label, whose counter is expected at a rate."""
        self._label, self._rate_hz = label, rate_hz
        self._modulus = block.modulus("sequence")
        self._clock_modulus = block.modulus("time") if "time" in block.names else 0.0
        self._first: Instant | None = None
        self._last: Instant | None = None

    def note(self, values: Mapping[str, float], asked: float, answered: float) -> Instant:
        """Return the sample's instant, without wraparounds.

        Parameters
        ----------
        values : Mapping
            ``sequence``, and ``time`` (s) of a device with a clock.
        asked, answered : float
            This computer's clock, s.

        Raises
        ------
        DeviceError
            Counter or clock does not fit the sample before or the first one.
        """
        sequence, seconds = values["sequence"], values.get("time")
        if self._last:
            sequence = unwrap(sequence, self._last.sequence, self._modulus)
            if seconds is not None:
                assert self._last.time is not None
                seconds = unwrap(seconds, self._last.time, self._clock_modulus)
        now = Instant(int(sequence), seconds, asked, answered)
        if self._last and self._last.sequence == now.sequence:
            return now
        for before in (self._last, self._first):
            if before:
                self._compare(before, now)
        self._first, self._last = self._first or now, now
        return now

    def _compare(self, before: Instant, now: Instant) -> None:
        counts = now.sequence - before.sequence
        # Each sample was latched at most a period before its request, and before its answer.
        shortest, longest = now.asked - before.answered, now.answered - before.asked
        label, within = self._label, f"within {longest:.3g} s"
        if not self._fits(counts / self._rate_hz, shortest, longest) or counts <= 0:
            raise DeviceError(
                f"{label}: its counter went from {before.sequence} to {now.sequence} {within},"
                f" expected {self._rate_hz:g} a second; correct acquire.sample_rate_hz, or see"
                " whether it was restarted"
            )
        if now.time is None or before.time is None:
            return
        if not self._fits(now.time - before.time, shortest, longest) or now.time <= before.time:
            raise DeviceError(
                f"{label}: its clock went from {before.time:.6g} to {now.time:.6g} s {within};"
                " correct the unit of read.time, or see whether it was restarted"
            )

    def _fits(self, seconds: float, shortest: float, longest: float) -> bool:
        """Return whether a clock's advance lies between two durations, all in s."""
        period = 1.0 / self._rate_hz
        low = (1.0 - RATE_TOLERANCE) * shortest - period
        return low <= seconds <= (1.0 + RATE_TOLERANCE) * longest + period
