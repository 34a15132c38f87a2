"""Histogram of the time that a cycle's answers take, whose size does not grow with a run."""

from itertools import accumulate
from math import log
from typing import Any

SHORTEST_S, STEP, BINS = 1e-5, 1.01, 1400
"""Lower end, s, ratio of neighbouring bins, and their number: up to some ten seconds."""


class Latencies:
    """Durations from a cycle's set-points to the last of its answers."""

    def __init__(self) -> None:
        self._counts = [0] * BINS
        self._longest = 0.0

    def add(self, seconds: float) -> None:
        """Count one cycle."""
        # Bins of equal ratio: percentiles are within 1 % of their value, whatever that is.
        place = int(log(max(seconds / SHORTEST_S, 1.0)) / log(STEP))
        self._counts[min(place, BINS - 1)] += 1
        self._longest = max(self._longest, seconds)

    def metadata(self) -> dict[str, Any]:
        """Return the entries of a recording's metadata; empty where there was no cycle."""
        cycles = sum(self._counts)
        if not cycles:
            return {}
        shares = {"median_ms": 0.5, "p99_ms": 0.99}
        percentiles = {name: 1e3 * self._quantile(share * cycles) for name, share in shares.items()}
        return {"cycles": cycles, **percentiles, "longest_ms": 1e3 * self._longest}

    def _quantile(self, rank: float) -> float:
        """Return the middle of the bin with the duration of a rank, s."""
        place = next(k for k, so_far in enumerate(accumulate(self._counts)) if so_far >= rank)
        return min(SHORTEST_S * STEP ** (place + 0.5), self._longest)
