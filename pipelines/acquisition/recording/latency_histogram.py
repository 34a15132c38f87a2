"""How long the answers of a cycle take while the leg moves; counted, so that memory does not grow
with a run."""

from itertools import accumulate
from math import log
from typing import Any

SHORTEST_S, STEP, BINS = 1e-5, 1.01, 1400
"""Durations are told apart to a hundredth, from 10 µs to some ten seconds."""


class Latencies:
    """Durations from a cycle's set-points to the last of its answers."""

    def __init__(self) -> None:
        self._counts = [0] * BINS
        self._longest = 0.0

    def add(self, seconds: float) -> None:
        """Count one cycle."""
        place = int(log(max(seconds / SHORTEST_S, 1.0)) / log(STEP))
        self._counts[min(place, BINS - 1)] += 1
        self._longest = max(self._longest, seconds)

    def metadata(self) -> dict[str, Any]:
        """Return what a recording says of them; empty where there was no cycle."""
        if not (cycles := sum(self._counts)):
            return {}
        shares = {"median_ms": 0.5, "p99_ms": 0.99}
        percentiles = {name: 1e3 * self._quantile(share * cycles) for name, share in shares.items()}
        return {"cycles": cycles, **percentiles, "longest_ms": 1e3 * self._longest}

    def _quantile(self, rank: float) -> float:
        """Return the middle of the bin that holds the duration of a rank, s."""
        place = next(k for k, so_far in enumerate(accumulate(self._counts)) if so_far >= rank)
        return min(SHORTEST_S * STEP ** (place + 0.5), self._longest)
