"""Statistics of the time that answers take."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

BINS = 16


@dataclass(frozen=True)
class Latency:
    """Durations of one kind of request, s."""

    count: int
    least: float
    median: float
    p99: float
    most: float
    histogram: tuple[int, ...]
    """Counts in ``BINS`` equal steps from least to most, on a logarithmic scale."""

    @classmethod
    def of(cls, durations: NDArray) -> "Latency":
        """Summarize durations.

        Parameters
        ----------
        durations : (n,) array
            s, at least one.
        """
        least, median, p99, most = np.quantile(durations, [0.0, 0.5, 0.99, 1.0])
        counts, _ = np.histogram(np.log(durations), BINS, (np.log(least), np.log(most) + 1e-12))
        return cls(
            len(durations),
            float(least),
            float(median),
            float(p99),
            float(most),
            tuple(counts.tolist()),
        )

    def as_json(self) -> dict:
        """Return the statistics in milliseconds."""
        return {
            "count": self.count,
            "min_ms": self.least * 1e3,
            "median_ms": self.median * 1e3,
            "p99_ms": self.p99 * 1e3,
            "max_ms": self.most * 1e3,
            "histogram": list(self.histogram),
        }
