"""Ordinary and weighted least squares; a joint's weight is the inverse variance of its residual.

Sources: Gautier and Khalil (1992), Int. J. Robotics Research 11(4); for the weights, Gautier
(1997), Proc. ICRA. This is the cheapest method: it reads the runs once for the values, and twice
more for the covariance.
"""

from collections.abc import Hashable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipelines.estimation.compressed import CompressedRows, normal_equations, residual_rms
from pipelines.estimation.estimator import Estimator, Fit, carry_of
from pipelines.estimation.normal_matrix import inverse
from pipelines.estimation.problem import Problem
from pipelines.estimation.regression import by_segment, residual_of

LEAST_NM = 1e-6
"""Least residual of a joint for its weight, N·m; a perfect fit would have infinite weight."""


class WeightedLeastSquares(Estimator):
    """Least squares with joints weighted by the inverse variance of their residuals."""

    name = "weighted_least_squares"
    short = "wls"
    title = "weighted least squares"
    reweightings = 3
    """Number of times that the joints are weighted again."""

    def fit(self, problem: Problem) -> Fit:
        """Fit all runs at once.

        Parameters
        ----------
        problem : Problem
            Runs of J joints.

        Returns
        -------
        Fit
            ``about`` holds ``joint_weights_1_nm2``: an inverse variance of each joint that has
            rows, 1/(N·m)².
        """
        rows, held = problem.rows, problem.of_held
        # Held parameters act through their torque alone: friction, in the step of the wearer.
        free = CompressedRows(
            rows.regressor[:, :, problem.fitted],
            rows.torque - rows.regressor[:, :, held] @ problem.held[held],
            rows.count,
        )
        weights = self._weights(free, problem.names)
        normal, right = normal_equations(free, weights)
        sensitivity = inverse(normal, problem.names)
        values = sensitivity @ right
        # The carry needs the scores' derivative by held columns too.
        slope = normal_equations(rows, weights)[0][problem.fitted]
        return Fit(
            values,
            normal,
            sensitivity,
            carry_of(problem, sensitivity, slope),
            weights,
            partial(_scores, problem, values, weights),
            {"joint_weights_1_nm2": weights[rows.count > 0].tolist()},
        )

    def _weights(self, rows: CompressedRows, names: list[str]) -> NDArray:
        # Feasible generalised least squares, which begins with equal weights.
        weights = np.ones(len(rows.count))
        for _ in range(self.reweightings):
            normal, right = normal_equations(rows, weights)
            values = inverse(normal, names) @ right
            weights = 1.0 / np.maximum(residual_rms(rows, values), LEAST_NM) ** 2
        return weights


class OrdinaryLeastSquares(WeightedLeastSquares):
    """Least squares with equal weights for all joints, whatever their noise."""

    name = "ordinary_least_squares"
    short = "ols"
    title = "ordinary least squares"
    reweightings = 0


def _scores(
    problem: Problem, values: NDArray, weights: NDArray
) -> Iterator[tuple[Hashable, NDArray]]:
    """Yield the scores of least squares: each block's part of the normal equations' residual."""
    every = problem.completed(values)
    for number, r in problem.regressions():
        # Rows near reversals count zero and are kept, so that a lag stays a time.
        residual = np.where(r.usable, residual_of(r, every), 0.0)
        scores = np.einsum("mj,mjk,j->mk", residual, r.regressor[:, :, problem.fitted], weights)
        for segment, rows in by_segment(r.segment, scores):
            yield (number, segment), rows
