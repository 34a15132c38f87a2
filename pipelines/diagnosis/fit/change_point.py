"""Find when an effect begins in a run, exactly, with its uncertainty.

After its onset an effect acts as if it had always been present. So the squared error of every
instant is the sum of two running sums: the residual without the effect before, and with it after.
That error grows with the distance from the instant, not with its square, so its curvature does not
give the uncertainty. The ratio of likelihoods gives it, whatever the motion (Hansen, 2000,
Econometrica 68(3), theorem 2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import ALWAYS, NEVER
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.estimation.long_run import long_run_covariance

ALIKE_S = 0.5
"""Correlation time of model error, s. It depends on the motion, whose fastest parts are about 1
Hz."""


@dataclass(frozen=True)
class Onset:
    """Weighted squared error of a run for each instant at which an effect may begin."""

    instants: NDArray
    """(m + 1,) s: ``ALWAYS``, between each block and the next, ``NEVER``."""
    squares: NDArray
    """(m + 1,)."""
    pull: NDArray
    """(m, O) 1/(N·m): the weighted effect; zero where no sample is learnt from."""
    size: float
    """Weighted square of the whole effect."""
    inflation: float
    """Variance inflation of the instant for correlated blocks: the long-run variance of the noise
    in the difference of two instants' likelihoods, over that of white noise with the given
    weights."""
    critical: float = -2.0 * float(np.log(1.0 - np.sqrt(0.95)))
    """95 % quantile of the ratio of likelihoods, 7.35: that of the larger peak of two walks that
    drift down."""

    @classmethod
    def of(
        cls, run: Run, without: NDArray, throughout: NDArray, learnt: NDArray, weights: NDArray
    ) -> "Onset":
        """Compute the squared errors of all instants from residuals without and with the effect.

        Parameters
        ----------
        run : Run
        without, throughout : (m, O) arrays
            Residuals where the effect never begins, and where it is always present, N·m.
        learnt : (m, O) array of bool
            Samples that are fitted.
        weights : (O,) array
            The outputs' inverse variances, 1/(N·m)².
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
        # Their running sum is the noise by which the likelihoods of two instants differ.
        scores = np.sum(pull * residual, axis=1, keepdims=True)
        noise = float(long_run_covariance(lambda: [(0, scores)], 1).covariance[0, 0])
        instants = np.concatenate([[ALWAYS], 0.5 * (run.time[1:] + run.time[:-1]), [NEVER]])
        return cls(instants, squares, pull, size, noise / size if size > 0.0 else 1.0)

    @property
    def likeliest(self) -> float:
        """The middle one of the instants that explain the run equally well, s.

        An effect that is always or never present is simpler, and is preferred where chance may make
        the difference.
        """
        doubt = self.critical * self.inflation
        for simple in (0, -1):
            if self.squares[simple] <= self.squares.min() + doubt:
                return float(self.instants[simple])
        # Weighted squared error within which two onsets explain a run equally well.
        alike = 4.0
        likely = self.instants[self.squares < self.squares.min() + alike]
        return float(likely[len(likely) // 2])

    def interval(self, run: Run, misfit: NDArray) -> tuple[float, float]:
        """Return the ends of the 95 % interval, s, from the run's first block to its last.

        Parameters
        ----------
        run : Run
        misfit : (O,) array
            Model error that depends on the motion, and so is correlated from block to block, N·m.
        """
        # Model error is alike over some blocks, so the variance of its sum is that much larger.
        wrong = run.blocks_in(ALIKE_S) * float(np.sum((self.pull * misfit) ** 2))
        doubt = self.critical * (self.inflation + wrong / self.size) if self.size > 0.0 else np.inf
        held = np.flatnonzero(self.squares <= self.squares.min() + doubt)
        # Between two of these instants no block shows when it began.
        ends = np.clip([held.min() - 1, held.max() + 1], 1, len(self.instants) - 2)
        low, high = self.instants[ends]
        return float(low), float(high)
