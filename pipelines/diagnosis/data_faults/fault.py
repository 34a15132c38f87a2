"""A fault of acquisition, with its proof, and the samples of the channel that are wrong."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.fault_kind import FaultKind
from pipelines.contracts.joints import joints_of
from pipelines.diagnosis.data_faults.proof import Proof, Ruling
from pipelines.mechanics.motion import Motion

WHOLE_ROW = "all channels"


@dataclass(frozen=True, eq=False)
class Fault:
    """One fault of a recording that is not physics."""

    kind: FaultKind
    file: str
    channel: str
    """The column's name in the file, or ``WHOLE_ROW``."""
    what: str
    """The fault, its extent, its time, and the remedy."""
    samples: NDArray | None = None
    """(n,) bool, the samples that are left out; None where the channel is used as recorded."""
    proof: Proof | None = None
    """What mending it would change; None where it is left out, or nothing can be compared."""
    without_cuffs: bool = False
    """Whether the run's cuff forces are left out."""
    accepted: bool = False
    """Whether the user overruled its veto, or that its samples are left out."""

    @property
    def ruling(self) -> Ruling:
        """What it may do to the diagnosis."""
        return self.proof.ruling if self.proof else Ruling.CAVEAT

    @property
    def is_veto(self) -> bool:
        """Whether it stops the diagnosis, unless the user accepts it."""
        return self.ruling is Ruling.VETO

    @property
    def spoils(self) -> bool:
        """Whether it prevents any statement on the physics of the session."""
        return self.is_veto and not self.accepted

    @property
    def is_used(self) -> bool:
        """Whether the diagnosis uses what is wrong as it was recorded."""
        return self.samples is None and not self.without_cuffs

    @property
    def in_words(self) -> str:
        """The fault, its remedy, its proof, and how to overrule it."""
        sentences = f"{self.what}. {self.proof.in_words}" if self.proof else self.what
        if self.accepted:
            return f'{sentences}; accepted by [diagnose] accept = ["{self.kind}"]'
        if self.proof is None:
            return sentences
        if self.is_veto:
            return f'{sentences}; if it is right as it is, set [diagnose] accept = ["{self.kind}"]'
        return f"{sentences}: too little to stop at"

    def used_as_recorded(self) -> "Fault":
        """Return the fault of samples that the user accepts as they are."""
        return replace(self, samples=None, accepted=True)

    def judged(self, accept: tuple[FaultKind, ...]) -> "Fault":
        """Return the fault, accepted where the user overrules a veto of its kind."""
        return replace(self, accepted=self.is_veto and self.kind in accept)


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
