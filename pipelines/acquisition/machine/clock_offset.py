"""Drifting clocks: how far each drive's samples run ahead of the first drive's.

A reply names a drive's newest sample, so that sample was latched before the reply came, and the
next one after the request was sent. Each reply thus bounds from both sides when the drive samples.
The narrowest bounds within a short time give that instant to a fraction of the line's latency,
however late single replies are. Both drives' bounds are on the host's clock, which cancels in their
difference.
"""

from dataclasses import dataclass

import numpy as np

BUCKET_S = 0.5
"""Time within which a drift may be neglected: 50 ppm are 25 us then."""


class Bounds:
    """Bounds, over a short time, of sampling instants: sample n at ``origin`` + n periods."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._latest, self._earliest = np.inf, -np.inf
        self._last: tuple[float, float] | None = None

    def add(self, sequence: int, sent: float, received: float) -> None:
        """Add a request's bounds.

        Parameters
        ----------
        sequence : int
            Number of the newest sample in its answer.
        sent, received : float
            Host's clock, s.
        """
        self._latest = min(self._latest, received - sequence * self._period_s)
        self._earliest = max(self._earliest, sent - (sequence + 1) * self._period_s)

    def close(self) -> tuple[float, float] | None:
        """Return the bounds, then start again.

        Returns
        -------
        tuple of float or None
            Origin and width, s; None without replies.
        """
        if not np.isfinite(self._latest):
            return None
        self._last = self.now()
        self._latest, self._earliest = np.inf, -np.inf
        return self._last

    def now(self) -> tuple[float, float]:
        """Return the bounds so far.

        Returns
        -------
        tuple of float
            Origin and width, s.
        """
        # Over a longer time a drift can bring the bounds past each other.
        return (self._latest + self._earliest) / 2, max(self._latest - self._earliest, 0.0)

    def until_next_sample(self, now: float) -> float | None:
        """Return the time until the drive's next sample.

        Parameters
        ----------
        now : float
            Host's clock, s.

        Returns
        -------
        float or None
            s; None while that is unknown.
        """
        if self._last is None:
            return None
        return (self._last[0] - now) % self._period_s


@dataclass(frozen=True)
class Estimate:
    """A drive's lead: at sample n of the first drive it is at n + ``lead`` + ``rate`` (n - at)."""

    lead: float
    """Samples."""
    rate: float
    """Samples gained each sample."""
    at: int
    """Sample of the first drive to which the lead belongs."""
    lead_error: float
    rate_error: float
    """Standard errors, estimated conservatively."""

    def position(self, sequence: int) -> float:
        """Return the drive's own fractional sample number at a sample of the first drive."""
        return sequence + self.lead + self.rate * (sequence - self.at)


class Drift:
    """A straight line through a drive's leads, fitted with exponentially fading weights."""

    def __init__(self, rate_hz: float) -> None:
        # Prior standard deviation of the relative difference of two clocks' rates.
        usual = 200e-6
        self._rate_hz = rate_hz
        # None on the lead; slopes are in samples a second. Few buckets alone would leave the slope
        # undefined.
        self._prior = np.diag([0.0, (usual * rate_hz) ** -2])
        self._sums = np.zeros((2, 2))
        self._moment = np.zeros(2)
        self._buckets = 0.0
        self._origin: tuple[int, float] | None = None
        self.estimate: Estimate | None = None

    def add(self, sequence: int, first: tuple[float, float], other: tuple[float, float]) -> None:
        """Add both drives' bounds near a sample of the first drive.

        Parameters
        ----------
        sequence : int
            Number of that sample.
        first, other : tuple of float
            Origin and width, s.
        """
        # Time constant with which old bounds are forgotten: a quartz depends on its temperature.
        memory_s = 300.0
        # Smallest credible width of bounds, in samples: request and reply take different times.
        narrowest = 0.01
        # At one instant t the drives have the numbers (t - origin) / period.
        lead = (first[0] - other[0]) * self._rate_hz
        width = np.hypot(first[1], other[1]) * self._rate_hz
        if self._origin is None:
            # Relative to the first bounds: sums of squared counters would lose the digits that
            # matter.
            self._origin = sequence, lead
        # Uniform between the bounds: their width is sqrt(12) standard deviations.
        weight = 12.0 / (width**2 + 12.0 * narrowest**2)
        row = np.array([1.0, (sequence - self._origin[0]) / self._rate_hz])
        memory = np.exp(-BUCKET_S / memory_s)
        self._sums = memory * self._sums + weight * np.outer(row, row)
        self._moment = memory * self._moment + weight * row * (lead - self._origin[1])
        self._buckets = memory * self._buckets + 1.0
        self.estimate = self._solve(sequence)

    def _solve(self, sequence: int) -> Estimate:
        assert self._origin is not None  # set by the first bounds
        covariance = np.linalg.inv(self._sums + self._prior)
        lead, slope = covariance @ self._moment
        # Requests keep their phase for long, so the errors of neighbouring buckets are correlated.
        correlated = self._buckets * covariance
        row = np.array([1.0, (sequence - self._origin[0]) / self._rate_hz])
        return Estimate(
            lead=float(self._origin[1] + lead + slope * row[1]),
            rate=float(slope / self._rate_hz),
            at=sequence,
            lead_error=float(np.sqrt(row @ correlated @ row)),
            rate_error=float(np.sqrt(correlated[1, 1]) / self._rate_hz),
        )
