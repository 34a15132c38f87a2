"""When something begins in a run: the one change in time that is sought exactly, and how far it is
known.

What has begun acts as if it had always been there. So the squared error of every instant at once is
made of two running sums: of what is left without it before, and with it after. That error grows
with the distance from the instant and not with its square, so no curvature tells how far the
instant is known; its ratio of likelihoods does, whatever the motion (Hansen, 2000, Econometrica
68(3), theorem 2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import ALWAYS, NEVER
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.estimation.long_run import long_run_covariance

ALIKE_S = 0.5
"""How long what a model gets wrong stays alike: it goes with the motion, whose fastest parts are
about 1 Hz."""
ALIKE = 4.0
"""Weighted squared error within which two onsets explain a run alike."""
CRITICAL = -2.0 * float(np.log(1.0 - np.sqrt(0.95)))
"""Of the ratio of likelihoods: 7.35, below which the larger peak of two walks that drift down is in
95 % of cases."""


@dataclass(frozen=True)
class Onset:
    """Weighted squared error of a run for each instant at which something may begin in it."""

    instants: NDArray
    """(m + 1,) s: ``ALWAYS``, between each block and the next, ``NEVER``."""
    squares: NDArray
    """(m + 1,)."""
    pull: NDArray
    """(m, O) 1/(N·m): what begins, weighed; nought where it was not learnt from."""
    size: float
    """Weighted square of all that it would do."""
    inflation: float
    """How much further an instant is in doubt than if every block were news: the long-run variance
    of what noise adds to the difference of two instants' likelihoods, over its variance were the
    noise white and as the weights say."""

    @classmethod
    def of(
        cls, run: Run, without: NDArray, throughout: NDArray, learnt: NDArray, weights: NDArray
    ) -> "Onset":
        """Weigh what is left (m, O) where it never comes and where it was there throughout, on
        ``learnt`` (m, O).

        ``weights`` (O,) are the outputs' inverse variances.
        """
        before, after = (
            np.where(learnt, residual**2, 0.0) @ weights for residual in (without, throughout)
        )
        ahead = np.concatenate([[0.0], np.cumsum(before)])
        behind = np.concatenate([np.cumsum(after[::-1])[::-1], [0.0]])
        squares = ahead + behind
        best = int(np.argmin(squares))
        residual = np.concatenate([without[:best], throughout[best:]])
        pull = np.where(learnt, weights * (without - throughout), 0.0)
        size = float(np.sum(pull * (without - throughout)))
        scores = np.sum(pull * residual, axis=1, keepdims=True)
        noise = float(long_run_covariance(lambda: [(0, scores)], 1).covariance[0, 0])
        instants = np.concatenate([[ALWAYS], 0.5 * (run.time[1:] + run.time[:-1]), [NEVER]])
        return cls(instants, squares, pull, size, noise / size if size > 0.0 else 1.0)

    @property
    def likeliest(self) -> float:
        """The middle one of the instants that explain the run alike, s.

        What was there all along, or never, needs no coincidence, and is taken where chance may make
        the difference.
        """
        doubt = CRITICAL * self.inflation
        for simple in (0, -1):
            if self.squares[simple] <= self.squares.min() + doubt:
                return float(self.instants[simple])
        likely = self.instants[self.squares < self.squares.min() + ALIKE]
        return float(likely[len(likely) // 2])

    def interval(self, run: Run, misfit: NDArray) -> tuple[float, float]:
        """Return the ends of the 95 % interval, s, no further than from the run's first block to
        its last.

        ``misfit`` (O,) N·m is what the model gets wrong with the motion, and so alike from block to
        block.
        """
        wrong = run.blocks_in(ALIKE_S) * float(np.sum((self.pull * misfit) ** 2))
        doubt = CRITICAL * (self.inflation + wrong / self.size) if self.size > 0.0 else np.inf
        held = np.flatnonzero(self.squares <= self.squares.min() + doubt)
        # Where between two of these it began, no block tells.
        ends = np.clip([held.min() - 1, held.max() + 1], 1, len(self.instants) - 2)
        low, high = self.instants[ends]
        return float(low), float(high)
