"""Statistics of the time that answers take."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Latency:
    """Durations of one kind of request."""

    count: int
    min_ms: float
    median_ms: float
    p99_ms: float
    max_ms: float
    histogram: tuple[int, ...]
    """Counts in equal steps from least to most, on a logarithmic scale."""

    @classmethod
    def of(cls, durations: NDArray) -> "Latency":
        """Summarize durations.

        Parameters
        ----------
        durations : (n,) array
            s, at least one.
        """
        shares = [0.0, 0.5, 0.99, 1.0]
        least, median, p99, most = (1e3 * np.quantile(durations, shares)).tolist()
        logs = np.log(durations)
        counts, _ = np.histogram(logs, 16, (logs.min(), logs.max() + 1e-12))
        return cls(len(durations), least, median, p99, most, tuple(counts.tolist()))
