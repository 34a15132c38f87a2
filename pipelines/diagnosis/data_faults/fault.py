"""A fault of acquisition, with the samples of the channel that are wrong."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import joints_of
from pipelines.mechanics.motion import Motion

WHOLE_ROW = "all channels"


@dataclass(frozen=True, eq=False)
class Fault:
    """One fault of a recording that is not physics."""

    file: str
    channel: str
    """The column's name in the file, or ``WHOLE_ROW``."""
    what: str
    """The fault, its extent, its time, and the remedy."""
    samples: NDArray | None = None
    """(n,) bool, the samples to mask; None where masking does not help: no physics is judged."""

    @property
    def spoils(self) -> bool:
        """Whether it prevents any statement on the physics of the session."""
        return self.samples is None


def column(motion: Motion, joint: int, quantity: str) -> str:
    """Return the name in the file of a quantity of joint number ``joint``."""
    return joints_of(motion.metadata)[joint].column(quantity)


def stretches(marked: NDArray) -> NDArray:
    """Return the stretches of consecutive true samples.

    Parameters
    ----------
    marked : (n,) bool array
        Samples.

    Returns
    -------
    (runs, 2) int array
        First sample, and one past the last.
    """
    edges = np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8))
    return np.column_stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)])


def constant_stretches(x: NDArray, least: int) -> NDArray:
    """Return the runs of equal values.

    Parameters
    ----------
    x : (n,) array
        Samples.
    least : int
        Least length of a run.

    Returns
    -------
    (runs, 2) int array
        First sample, and one past the last.
    """
    intervals = stretches(x[1:] == x[:-1])
    # A run of n equal steps joins n + 1 samples.
    intervals[:, 1] += 1
    return intervals[intervals[:, 1] - intervals[:, 0] >= least]


def mask_of(intervals: NDArray, n: int) -> NDArray:
    """Return the samples of stretches.

    Parameters
    ----------
    intervals : (runs, 2) int array
        First sample, and one past the last.
    n : int
        Number of samples.

    Returns
    -------
    (n,) bool array
        True within a stretch.
    """
    marked = np.zeros(n, dtype=bool)
    for start, stop in intervals:
        marked[start:stop] = True
    return marked


def when(motion: Motion, intervals: NDArray) -> str:
    """Return the times of stretches in words.

    Parameters
    ----------
    motion : Motion
        n samples.
    intervals : (runs, 2) int array
        First sample, and one past the last; at least one.
    """
    if len(intervals) == 1:
        start, stop = intervals[0]
        return f"from {motion.time[start]:.2f} s to {motion.time[stop - 1]:.2f} s"
    first, last = motion.time[intervals[0, 0]], motion.time[intervals[-1, 1] - 1]
    return f"{len(intervals)} times between {first:.2f} s and {last:.2f} s"
