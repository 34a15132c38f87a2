"""Instrumental variables (IDIM-IV): no bias from noise in the angles.

The regressor of least squares is measured. Noise in the angles, and more so in their derivatives,
correlates with the residual and biases the parameters towards zero. Instruments have the shape of
the motion and no noise: they are the regressor along a closed-loop simulation of the model on the
references. Values and instruments are computed in turn until they converge (Janot, Vandanjon and
Gautier, 2014, IEEE Trans. Control Systems Technology 22(1); Young, 2011, Recursive Estimation and
Time-Series Analysis, 6-7). The simulation need not be right, only free of the noise.
"""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipelines.dynamics.closed_loop import closed_loop
from pipelines.estimation.durbin_wu_hausman import DurbinWuHausman, durbin_wu_hausman
from pipelines.estimation.estimator import Estimator, Fit, carry_of, convergence_remark, estimated
from pipelines.estimation.least_squares import LEAST_NM, WeightedLeastSquares
from pipelines.estimation.normal_matrix import inverse
from pipelines.estimation.problem import Problem
from pipelines.estimation.realizable import nearest
from pipelines.estimation.regression import Regression, by_segment, residual_of


class InstrumentalVariables(Estimator):
    """Instruments from a closed-loop simulation of the model; whole runs are held in memory."""

    name = "instrumental_variables"
    short = "iv"
    title = "instrumental variables (IDIM-IV)"
    needs_every_torque = True

    def fit(self, problem: Problem) -> Fit:
        """Fit all runs at once, beginning with least squares.

        Parameters
        ----------
        problem : Problem
            Its runs need a reference and controller gains, by which they are simulated.

        Returns
        -------
        Fit
            ``about`` holds ``iterations``, ``settled`` and ``durbin_wu_hausman``.
        """
        problem = problem.whole()
        start = WeightedLeastSquares().fit(problem)
        measured = [r for _, r in problem.regressions()]
        values, weights = start.values, start.weights
        most = 20
        # Largest change of a value at convergence, in standard errors of independent blocks.
        small = 0.01
        for iteration in range(1, most + 1):  # noqa: B007
            # A model that cannot exist cannot be simulated, but the nearest that can.
            rows = _rows(problem, measured, nearest(problem, values, start.normal))
            solution = _solved(problem, rows, weights)
            weights = _weights(problem, rows, solution.values)
            # In standard errors of independent blocks, because units differ between parameters.
            change = np.abs(solution.values - values) / np.sqrt(
                np.diag(solution.sensitivity @ solution.normal @ solution.sensitivity.T)
            )
            values = solution.values
            if change.max() < small:
                break
        # Both use the same rows and weights, so that only the instruments differ.
        itself = [replace(r, instruments=r.measured.regressor) for r in rows]
        test = durbin_wu_hausman(_solved(problem, itself, solution.weights), solution)
        settled = bool(change.max() < small)
        about = {"iterations": iteration, "settled": settled, "durbin_wu_hausman": test.as_json()}
        remarks = (
            *convergence_remark(settled, f"{most} iterations"),
            _sentence(test, problem.names, solution),
        )
        return replace(solution, about=about, remarks=remarks)


@dataclass(frozen=True)
class _Rows:
    """One run's rows: as measured, and the instruments."""

    measured: Regression
    instruments: NDArray
    """(m, J, p)."""
    usable: NDArray
    """(m, J) bool: away from the measured and the simulated reversals."""


def _rows(problem: Problem, measured: Sequence[Regression], values: NDArray) -> list[_Rows]:
    training, every, rows = problem.training, problem.completed(values), []
    for (_, run), r in zip(problem.runs, measured, strict=True):
        # The loop follows the set-points, so it has the excitation and not the noise.
        moved = closed_loop(training.model_of(run, every), run.whole())
        # Loads are computed again: those of the measured motion hold the noise of its angles.
        (simulated,) = training.regressions(training.loaded(moved))
        # The simulated joint reverses at other instants than the measured one, so both are masked.
        rows.append(_Rows(r, simulated.regressor, r.usable & simulated.usable))
    return rows


def _solved(problem: Problem, rows: Sequence[_Rows], weights: NDArray) -> Fit:
    k, p = len(problem.fitted), len(problem.held)
    slope, normal, right = np.zeros((k, p)), np.zeros((k, k)), np.zeros(k)
    for r in rows:
        # The equations are Z'W (tau - X theta) = 0. ``slope`` is Z'WX, and Z'WZ shows which
        # parameters the instruments separate.
        Z = r.instruments[:, :, problem.fitted]
        W = r.usable * weights
        slope += np.einsum("mj,mjk,mjp->kp", W, Z, r.measured.regressor, optimize=True)
        normal += np.einsum("mj,mjk,mjl->kl", W, Z, Z, optimize=True)
        right += np.einsum("mj,mjk,mj->k", W, Z, r.measured.torque, optimize=True)
    inverse(normal, problem.names)  # Raises if the instruments do not separate the parameters.
    # ``inverse`` is for symmetric matrices, and Z'WX is not symmetric.
    sensitivity = np.linalg.inv(slope[:, problem.fitted])
    held = problem.of_held
    values = sensitivity @ (right - slope[:, held] @ problem.held[held])
    return Fit(
        values,
        normal,
        sensitivity,
        carry_of(problem, sensitivity, slope),
        weights,
        partial(_scores, problem, rows, values, weights),
    )


def _weights(problem: Problem, rows: Sequence[_Rows], values: NDArray) -> NDArray:
    every = problem.completed(values)
    squares = sum(
        np.sum(np.where(r.usable, residual_of(r.measured, every), 0.0) ** 2, axis=0) for r in rows
    )
    count = sum(r.usable.sum(axis=0) for r in rows)
    return np.asarray(1.0 / np.maximum(squares / np.maximum(count, 1), LEAST_NM**2))


def _scores(
    problem: Problem, rows: Sequence[_Rows], values: NDArray, weights: NDArray
) -> Iterator[tuple[Hashable, NDArray]]:
    every = problem.completed(values)
    for (number, _), r in zip(problem.runs, rows, strict=True):
        # Rows near reversals count zero and are kept, so that a lag stays a time.
        pull = np.where(r.usable, residual_of(r.measured, every), 0.0) * weights
        scores = np.einsum("mj,mjk->mk", pull, r.instruments[:, :, problem.fitted])
        for segment, part in by_segment(r.measured.segment, scores):
            yield (number, segment), part


def _sentence(test: DurbinWuHausman, names: Sequence[str], fit: Fit) -> str:
    among, rest = test.freedom
    numbers = (
        f"Durbin-Wu-Hausman F({among:.0f}, {rest:.0f}) = {test.statistic:.2f}, p ="
        f" {test.p_value:.2g}"
    )
    if not test.rejects:
        return (
            f"no sign that noise in the angles biases least squares ({numbers}):"
            " weighted_least_squares serves as well"
        )
    matters = _matters(test, fit)
    if not matters.any():
        return (
            f"noise in the angles shows in least squares ({numbers}) but does not matter: every"
            " parameter moves by less than a twentieth of its 95 % interval, or by less than"
            " 0.1 % of itself; weighted_least_squares serves as well"
        )
    worst = int(np.argmax(np.where(matters, np.abs(test.difference / test.std_error), 0.0)))
    return (
        f"noise in the angles biases least squares ({numbers}), {names[worst]} most: least squares"
        f" has it {100 * test.difference[worst] / abs(fit.values[worst]):+.1f} % off these values"
    )


def _matters(test: DurbinWuHausman, fit: Fit) -> NDArray:
    """Return which parameters' bias in least squares is large enough to matter, (k,) bool."""
    # Share of the half-width of a parameter's 95 % interval within which a bias does not matter.
    # The two estimates share their noise, so the test detects much less; yet the interval about
    # either still covers the truth 94.5 times of 100.
    slight = 0.1
    estimate = estimated(fit)
    reach = estimate.critical * np.sqrt(np.diag(estimate.covariance))
    off = np.abs(test.difference)
    # Nor does one of 0.1 %: no torque scale is known any better, however long the recording.
    return np.asarray((off > slight * reach) & (off > 0.001 * np.abs(fit.values)))
