"""The regression filter: block averages of the torque and of every regressor column.

Filtering the torque alone would multiply the noise of a perfect fit by up to four. Filtering both
sides alike, in blocks too short to reach a reversal, keeps the noise as it is
(docs/identification.md).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d


@dataclass(frozen=True)
class BlockAverage:
    """Average over blocks of ``decimation`` samples; no block spans a gap."""

    decimation: int

    @classmethod
    def lasting(cls, seconds: float, rate_hz: float) -> "BlockAverage":
        """Return the filter with blocks of about some seconds.

        Parameters
        ----------
        seconds : float
            Length of a block, s.
        rate_hz : float
            Sample rate, Hz.
        """
        return cls(max(1, round(seconds * rate_hz)))

    def cutoff_hz(self, rate_hz: float) -> float:
        """Return the frequency at which the mean has lost half the power.

        Parameters
        ----------
        rate_hz : float
            Sample rate, Hz.

        Returns
        -------
        float
            Hz.
        """
        # Half-power frequency of a running mean times its length.
        half_power = 0.443
        return half_power * rate_hz / self.decimation

    def as_metadata(self, rate_hz: float) -> dict[str, Any]:
        """Return the filter's entry in the metadata of ``motion/1``."""
        return {
            "kind": "block_average",
            "order": 1,
            "cutoff_hz": self.cutoff_hz(rate_hz),
            "decimation": self.decimation,
        }

    def starts(self, segment: NDArray, before: int = 0) -> NDArray:
        """Return the first sample of each whole block.

        Parameters
        ----------
        segment : (n,) array
            Segment number of each sample; each segment begins a new block.
        before : int
            Samples of the first segment that precede the array.

        Returns
        -------
        (blocks,) array
            Indices of samples.
        """
        # The prepended number differs from the first, so that sample 0 begins a segment.
        first = np.flatnonzero(np.diff(segment, prepend=segment[0] - 1))
        last = np.append(first[1:], len(segment))
        # Blocks continue those of the piece before, as if the run were in one piece.
        first[0] = -before % self.decimation
        width = self.decimation
        return np.concatenate(
            [np.arange(a, b - width + 1, width) for a, b in zip(first, last, strict=True)]
        )

    def mean(self, x: NDArray, starts: NDArray) -> NDArray:
        """Average over each block.

        Parameters
        ----------
        x : (n, ...) array
            Samples, in any unit.
        starts : (blocks,) array
            First sample of each block.

        Returns
        -------
        (blocks, ...) array
            Means, in the unit of ``x``.
        """
        if self.decimation == 1:
            return x[starts]
        # A loop needs memory for one array of means; to gather all samples at once takes far more.
        total = np.zeros((len(starts), *x.shape[1:]))
        for offset in range(self.decimation):
            total += np.take(x, starts + offset, axis=0)
        total /= self.decimation
        return total

    def all(self, x: NDArray, starts: NDArray) -> NDArray:
        """Return whether every sample of each block is true.

        Parameters
        ----------
        x : (n, ...) bool array
            Samples.
        starts : (blocks,) array
            First sample of each block.

        Returns
        -------
        (blocks, ...) bool array
        """
        whole = np.ones((len(starts), *x.shape[1:]), dtype=bool)
        for offset in range(self.decimation):
            whole &= x[starts + offset]
        return whole


def dilate(x: NDArray, samples: int) -> NDArray:
    """Spread every true value to both sides.

    Parameters
    ----------
    x : (n,) bool array
        Samples.
    samples : int
        How far a true value spreads.

    Returns
    -------
    (n,) bool array
        True within ``samples`` of a true value.
    """
    return maximum_filter1d(x.astype(np.uint8), 2 * samples + 1, mode="constant").astype(bool)
