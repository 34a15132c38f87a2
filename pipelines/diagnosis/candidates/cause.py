"""One shape of a cause, as columns of the decision regression."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.candidates.shape_refinement import CandidateFit
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression


@dataclass(frozen=True)
class Cause:
    """A cause at one shape, the baseline projected out of its columns.

    The columns are orthonormal in shares: the square of their coefficients is the squared share of
    the joint's torque that the cause has.
    """

    candidate: Candidate
    columns: NDArray
    """(N, k)."""
    amplitudes: NDArray
    """(p, k): the effect's own amplitudes per coefficient."""
    variance: NDArray
    """(k,) prior variance of each coefficient over their sum. It is larger for columns to which
    typical amplitudes add more."""
    derivative: NDArray
    """(N, d) change of the prediction along each shape, and towards another form."""
    imitation: NDArray
    """(b, k + d): values of the baseline that imitate columns and derivatives best, before it is
    projected out."""
    is_best_shape: bool
    """Whether it is the best shape of its effect."""
    refined_in: int = -1
    """The set of causes with which it was refined; -1 where it was refined alone."""

    @classmethod
    def of(
        cls,
        fitted: CandidateFit,
        slopes: NDArray,
        regression: DecisionRegression,
        *,
        is_best_shape: bool,
        refined_in: int = -1,
    ) -> "Cause | None":
        """Return a fitted candidate as a cause; None where the baseline explains all of it.

        Parameters
        ----------
        fitted : CandidateFit
            The candidate at its best shapes, with its columns.
        slopes : (N, d) array
            Change of the rows by each shape, per unit of change.
        is_best_shape : bool
            Whether these are the best shapes of the effect.
        refined_in : int, optional
            Number of the set with whose other causes it was refined; -1 where it was refined alone.
        """
        typical = fitted.candidate.typical(regression.kinds)
        # Typical amplitudes make columns of unlike units comparable. The singular vectors are then
        # orthonormal shares, the likeliest direction first.
        _, size, turned = np.linalg.svd(
            regression.shares(fitted.columns) * typical, full_matrices=False
        )
        # Relative size below which a direction of a cause's columns adds nothing to the larger
        # ones.
        negligible = 1e-6
        kept = size > negligible * max(size.max(initial=0.0), np.finfo(float).tiny)
        if not kept.any():
            return None
        amplitudes = typical[:, np.newaxis] * turned[kept].T / size[kept]
        rows = fitted.columns @ amplitudes
        # Before projection: by these values the baseline changes if the cause takes its part over.
        imitation = regression.baseline_values(np.hstack([rows, slopes]))
        # Typical amplitudes are known roughly. Exact ones give variances like the squares of sizes.
        variance = size[kept] / size[kept].sum()
        columns, derivative = regression.project(rows), regression.project(slopes)
        return cls(
            fitted.candidate,
            columns,
            amplitudes,
            variance,
            derivative,
            imitation,
            is_best_shape,
            refined_in,
        )


def towards(best: CandidateFit, others: Sequence[CandidateFit]) -> NDArray:
    """Return the change from the best form of a cause to its best other form.

    Parameters
    ----------
    best : CandidateFit
        The cause at its best form.
    others : sequence of CandidateFit
        Other fits of the effect, the best first.

    Returns
    -------
    (N, 0 or 1) array
        Difference of the rows; no column without another form.
    """
    forms = [p.forms for p in best.candidate.effect.shape]
    here = best.candidate.shapes[0]
    for other in others:
        there = other.candidate.shapes[0]
        if any(f and a != b for f, a, b in zip(forms, here, there, strict=True)):
            return (other.torque - best.torque)[:, np.newaxis]
    return np.zeros((len(best.torque), 0))
