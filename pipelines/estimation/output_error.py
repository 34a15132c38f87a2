"""Output error: the parameters whose simulation stays closest to the measured angles.

The recorded torque drives the model from the recorded state over short windows, and Gauss-Newton
steps within a trust region minimize its angle error (Ljung, 1999, System Identification, 7; for
robots Gautier, Janot and Vandanjon, 2013, IEEE TCST 21(2)). It needs no acceleration, reproduces
sticking joints, and keeps noise of the angles in the residual. It costs some hundred simulations of
each run.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pipelines.dynamics.replay import replay
from pipelines.estimation.estimator import Estimator, Fit, carry_of, convergence_remark
from pipelines.estimation.least_squares import WeightedLeastSquares
from pipelines.estimation.normal_matrix import inverse
from pipelines.estimation.problem import Problem
from pipelines.estimation.realizable import nearest

WINDOW_S = 0.5
"""Length of a window. Longer ones are more sensitive to noise of the torque, shorter ones to noise
of the first state."""


class OutputError(Estimator):
    """Windows of half a second under the recorded torque; whole runs are held in memory."""

    name = "output_error"
    short = "oe"
    title = "output error"
    masks = False
    needs_every_torque = True

    def fit(self, problem: Problem) -> Fit:
        """Fit all runs at once, beginning with the realizable least-squares model.

        Parameters
        ----------
        problem : Problem
            Runs whose recorded torque drives the simulation.

        Returns
        -------
        Fit
            ``about`` adds ``simulations``, a number, and ``settled``, a bool.
        """
        problem = problem.whole()
        start = WeightedLeastSquares().fit(problem)
        # Step of each value: a standard error if it is fitted, a fiftieth of itself if it is held.
        size = np.abs(problem.held) / 50.0
        size[problem.fitted] = np.sqrt(np.diag(start.sensitivity))
        # A search can only start from a model that can be simulated.
        values = nearest(problem, start.values, start.normal)
        simulations = 0
        # The joints are weighted again once.
        for _ in range(2):
            weights = _weights(_errors(problem, problem.completed(values)))
            values, more, settled = _searched(problem, values, size, weights)
            simulations += more
        fit = _fit(problem, values, size, weights)
        about = fit.about | {"simulations": simulations, "settled": settled}
        return replace(
            fit,
            about=about,
            remarks=convergence_remark(settled, f"{simulations} simulations of all runs"),
        )


def _errors(problem: Problem, every: NDArray) -> list[NDArray]:
    """Return the simulation's angle error, (windows, samples, J) for each run."""
    model_of = problem.training.model_of
    return [
        # Windows follow each other without overlap, so that each sample counts once.
        replay(model_of(run, every), run.whole(), WINDOW_S, WINDOW_S).error
        for _, run in problem.runs
    ]


def _slopes(
    problem: Problem, every: NDArray, columns: Sequence[int], size: NDArray
) -> list[NDArray]:
    """Return the derivatives of the angle error, (windows, samples, J, columns) for each run."""
    at = _errors(problem, every)
    slopes = [np.zeros((*error.shape, len(columns))) for error in at]
    # Step for derivatives, in standard errors of the start. It is small enough that a joint does
    # not stick noticeably longer or shorter.
    step = 0.5
    for place, column in enumerate(columns):
        # A held value of zero has no scale for a step, and keeps a slope of zero.
        if size[column] > 0.0:
            moved = every.copy()
            # Forward differences cost one simulation a column, central ones two.
            moved[column] += step * size[column]
            for slope, now, ahead in zip(slopes, at, _errors(problem, moved), strict=True):
                slope[..., place] = (ahead - now) / (step * size[column])
    return slopes


def _weights(errors: Sequence[NDArray]) -> NDArray:
    # Least rms angle error for a weight; a perfect fit would have infinite weight.
    least_rad = 1e-9
    squares = np.concatenate([error.reshape(-1, error.shape[-1]) ** 2 for error in errors])
    return np.asarray(1.0 / np.maximum(squares.mean(axis=0), least_rad**2))


def _searched(
    problem: Problem, values: NDArray, size: NDArray, weights: NDArray
) -> tuple[NDArray, int, bool]:
    """Minimize the weighted squared error.

    Return the values (k,), the number of simulations of all runs, and whether it converged.
    """
    # Relative decrease of the squared error at convergence; less than a tenth of a standard error.
    settled = 1e-5
    # Relative step at convergence.
    rests = 0.01
    # Angle error within a window, rad (m), above which no such machine can exist.
    ran_away = 10.0
    # Steps are in standard errors of the start: a trust region needs comparable units.
    unit, root = size[problem.fitted], np.sqrt(weights)
    # A simulation that fails returns nothing, so the number of its residuals is counted before.
    outputs = sum(error.size for error in _errors(problem, problem.completed(values)))

    def completed(step: NDArray) -> NDArray:
        return problem.completed(values + unit * step)

    def residual(step: NDArray) -> NDArray:
        # NaN makes the search take a shorter step away from a model that diverges or has a
        # singular mass matrix.
        try:
            errors = _errors(problem, completed(step))
        except ZeroDivisionError:
            return np.full(outputs, np.nan)
        residual = np.concatenate([(error * root).ravel() for error in errors])
        is_near = np.all(np.abs(residual) < ran_away * root.max())
        return residual if is_near else np.full(outputs, np.nan)

    def jacobian(step: NDArray) -> NDArray:
        slopes = _slopes(problem, completed(step), problem.fitted.tolist(), size)
        k = len(problem.fitted)
        return np.concatenate([(s * root[:, np.newaxis]).reshape(-1, k) for s in slopes]) * unit

    # The gradient grows with the number of residuals, so it is no test of convergence.
    solution = least_squares(
        residual, np.zeros(len(unit)), jacobian, method="trf", xtol=rests, ftol=settled, gtol=None
    )
    return (
        values + unit * solution.x,
        int(solution.nfev + solution.njev * (1 + len(unit))),
        bool(solution.success),
    )


def _fit(problem: Problem, values: NDArray, size: NDArray, weights: NDArray) -> Fit:
    every = problem.completed(values)
    errors = _errors(problem, every)
    # All columns, held ones too, because the carry needs their slopes.
    slopes = _slopes(problem, every, range(len(every)), size)
    # Gauss-Newton: second derivatives are neglected, as the residual is small.
    slope = sum(
        np.einsum("j,wnjk,wnjp->kp", weights, s[..., problem.fitted], s, optimize=True)
        for s in slopes
    )
    normal = np.asarray(slope)[:, problem.fitted]
    sensitivity = inverse(normal, problem.names)
    scores = [
        _window_scores(part[..., problem.fitted], e, weights, sensitivity)
        for part, e in zip(slopes, errors, strict=True)
    ]
    rms = np.sqrt([np.mean(e**2, axis=(0, 1)) for e in errors]).tolist()
    about = {"window_s": WINDOW_S, "angle_rms": rms}
    return Fit(
        values,
        normal,
        sensitivity,
        carry_of(problem, sensitivity, np.asarray(slope)),
        weights,
        lambda: enumerate(scores),
        about,
    )


def _window_scores(
    slopes: NDArray, errors: NDArray, weights: NDArray, sensitivity: NDArray
) -> NDArray:
    """Return one score for each window, (windows, k): within it nothing is independent.

    There are few windows, and each has pulled the fit towards itself. Its score without that is (I
    - G H⁻¹)⁻¹ times as large, where G is its part of the normal matrix (CR3 of Bell and McCaffrey,
    2002, Survey Methodology 28(2)).
    """
    # The error is measured less simulated, and ``slopes`` are its derivatives: hence the sign.
    scores = -np.einsum("j,wnjk,wnj->wk", weights, slopes, errors, optimize=True)
    parts = np.einsum("j,wnjk,wnjl->wkl", weights, slopes, slopes, optimize=True)
    own = np.eye(len(sensitivity)) - parts @ sensitivity
    return np.linalg.solve(own, scores[..., np.newaxis])[..., 0]
