"""Clocks that drift: how far one drive's samples have run ahead of the first drive's, seen through
the host's clock.

A reply tells which sample is a drive's newest, so that sample was latched before the reply came,
and the next one after the request was sent. Each reply thus bounds from both sides when a drive
took its samples; the narrowest bounds of a short time say it to a fraction of the line's latency,
however late single replies are. Both drives' bounds lie on the host's clock, which drops out of
their difference.
"""

from dataclasses import dataclass

import numpy as np

BUCKET_S = 0.5
"""Time within which a drift may be neglected: 50 ppm are 25 us then."""
FLOOR = 0.01
"""Share of a sample below which bounds are not believed to be narrow: the way out and the way back
differ."""
MEMORY_S = 300.0
"""Time after which bounds count no longer for much: a quartz goes with its temperature."""
USUAL = 200e-6
"""Standard deviation of what is believed of two clocks' rates before they have been watched."""


class Bounds:
    """When a drive takes its samples, by the host's clock: sample n at ``origin`` + n periods, for
    a short while."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._latest, self._earliest = np.inf, -np.inf
        self._last: tuple[float, float] | None = None

    def add(self, sequence: int, sent: float, received: float) -> None:
        """Note that a request sent and answered then (s) found this sample the newest."""
        self._latest = min(self._latest, received - sequence * self._period_s)
        self._earliest = max(self._earliest, sent - (sequence + 1) * self._period_s)

    def close(self) -> tuple[float, float] | None:
        """Return the origin and the width of its bounds (s), and begin anew; None where nothing was
        told."""
        if not np.isfinite(self._latest):
            return None
        self._last = self.now()
        self._latest, self._earliest = np.inf, -np.inf
        return self._last

    def now(self) -> tuple[float, float]:
        """Return the origin and the width of its bounds (s) as far as they are known."""
        # In a longer while a drift can bring the bounds past each other.
        return (self._latest + self._earliest) / 2, max(self._latest - self._earliest, 0.0)

    def ahead(self, now: float) -> float | None:
        """Return how long it is until the drive's next sample (s); None where that is not known
        yet."""
        if self._last is None:
            return None
        return (self._last[0] - now) % self._period_s


@dataclass(frozen=True)
class Estimate:
    """A drive's lead over the first one: at the first's sample n it is at its own n + ``lead`` +
    ``rate`` (n - at)."""

    lead: float
    """Samples."""
    rate: float
    """Samples gained each sample."""
    at: int
    """Sample of the first drive to which the lead belongs."""
    lead_error: float
    rate_error: float
    """Standard errors, on the safe side."""

    def position(self, sequence: int) -> float:
        """Return where the drive is in its own samples at a sample of the first one."""
        return sequence + self.lead + self.rate * (sequence - self.at)


class Drift:
    """A straight line through what the bounds say of a drive's lead, older ones counting less."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._prior = np.diag([0.0, (USUAL * rate_hz) ** -2])
        self._sums = np.zeros((2, 2))
        self._moment = np.zeros(2)
        self._buckets = 0.0
        self._origin: tuple[int, float] | None = None
        self.estimate: Estimate | None = None

    def add(self, sequence: int, first: tuple[float, float], other: tuple[float, float]) -> None:
        """Take in what both drives' bounds say, about when the first took a sample."""
        lead = (first[0] - other[0]) * self._rate_hz
        width = np.hypot(first[1], other[1]) * self._rate_hz
        if self._origin is None:
            self._origin = sequence, lead
        # The truth is evenly likely anywhere between bounds: their width is sqrt(12) standard
        # deviations.
        weight = 12.0 / (width**2 + 12.0 * FLOOR**2)
        row = np.array([1.0, (sequence - self._origin[0]) / self._rate_hz])
        kept = np.exp(-BUCKET_S / MEMORY_S)
        self._sums = kept * self._sums + weight * np.outer(row, row)
        self._moment = kept * self._moment + weight * row * (lead - self._origin[1])
        self._buckets = kept * self._buckets + 1.0
        self.estimate = self._solved(sequence)

    def _solved(self, sequence: int) -> Estimate:
        assert self._origin is not None  # something was added
        covariance = np.linalg.inv(self._sums + self._prior)
        lead, slope = covariance @ self._moment
        # Requests keep their phase for long, so that one bucket's error is much like the next
        # one's.
        alike = self._buckets * covariance
        row = np.array([1.0, (sequence - self._origin[0]) / self._rate_hz])
        return Estimate(
            lead=float(self._origin[1] + lead + slope * row[1]),
            rate=float(slope / self._rate_hz),
            at=sequence,
            lead_error=float(np.sqrt(row @ alike @ row)),
            rate_error=float(np.sqrt(alike[1, 1]) / self._rate_hz),
        )
