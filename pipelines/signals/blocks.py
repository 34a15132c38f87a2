"""The regression filter: averages over short blocks, applied to torque and every regressor column
alike.

Filtering the torque alone would leave a faultless fit with up to four times the noise; both sides
alike, and kept away from reversals by short blocks, leave the noise itself
(docs/identification.md).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

HALF_POWER = 0.443
"""Half-power frequency of a running mean times its length."""


@dataclass(frozen=True)
class BlockAverage:
    """Means over ``decimation`` samples; a block never reaches across a gap."""

    decimation: int

    @classmethod
    def lasting(cls, seconds: float, rate_hz: float) -> "BlockAverage":
        """Return the filter whose blocks last about ``seconds``."""
        return cls(max(1, round(seconds * rate_hz)))

    def cutoff_hz(self, rate_hz: float) -> float:
        """Return the frequency at which the mean has lost half the power."""
        return HALF_POWER * rate_hz / self.decimation

    def as_metadata(self, rate_hz: float) -> dict[str, Any]:
        """Return what a motion's metadata say of this filter (CONTRACTS, motion/1)."""
        return {
            "kind": "block_average",
            "order": 1,
            "cutoff_hz": self.cutoff_hz(rate_hz),
            "decimation": self.decimation,
        }

    def starts(self, segment: NDArray, before: int = 0) -> NDArray:
        """Return the first sample of each whole block, given each sample's segment number (n,).

        Where the first segment began earlier, ``before`` samples of it have gone already.
        """
        first = np.flatnonzero(np.diff(segment, prepend=segment[0] - 1))
        last = np.append(first[1:], len(segment))
        first[0] = -before % self.decimation
        width = self.decimation
        return np.concatenate(
            [np.arange(a, b - width + 1, width) for a, b in zip(first, last, strict=True)]
        )

    def mean(self, x: NDArray, starts: NDArray) -> NDArray:
        """Average ``x`` (n, ...) over the blocks: (blocks, ...)."""
        if self.decimation == 1:
            return x[starts]
        total = np.zeros((len(starts), *x.shape[1:]))
        for offset in range(self.decimation):
            total += x[starts + offset]
        return total / self.decimation

    def all(self, x: NDArray, starts: NDArray) -> NDArray:
        """Tell for each block whether every sample of boolean ``x`` (n, ...) is true."""
        whole = np.ones((len(starts), *x.shape[1:]), dtype=bool)
        for offset in range(self.decimation):
            whole &= x[starts + offset]
        return whole


def dilate(x: NDArray, samples: int) -> NDArray:
    """Spread every true sample of a boolean (n,) array by ``samples`` to both sides."""
    return maximum_filter1d(x.astype(np.uint8), 2 * samples + 1, mode="constant").astype(bool)
