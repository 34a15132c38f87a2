"""Physically realizable least squares: the least residual of the models that can exist.

A mass matrix that is positive definite at every angle is a linear matrix inequality in the inertial
parameters, and friction that takes energy is a sign constraint. So the fit is a convex program with
one solution (Sousa and Cortesão, 2014, Int. J. Robotics Research 33(6); Wensing, Kim and Slotine,
2018, IEEE RA-L 3(1)). Clarabel solves it.

A projection onto a convex set that contains the truth does not increase the error, in the norm of
the normal matrix. So the covariance of the free fit is kept; where a constraint is active,
intervals are rather too wide than too narrow.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from pipelines.errors import NotIdentifiable
from pipelines.estimation.compressed import residual_rms
from pipelines.estimation.estimator import Estimator, Fit
from pipelines.estimation.least_squares import WeightedLeastSquares
from pipelines.estimation.problem import Problem


class Realizable(Estimator):
    """Weighted least squares on the models that can exist."""

    name = "realizable"
    title = "physically realizable least squares"
    needs_every_torque = True

    def fit(self, problem: Problem) -> Fit:
        """Fit all runs at once, then find the nearest model that can exist.

        Parameters
        ----------
        problem : Problem
            Runs of J joints.

        Returns
        -------
        Fit
            ``about`` holds ``constrained`` and, where that is true, ``least_squares_values``.
        """
        free = WeightedLeastSquares().fit(problem)
        values = nearest(problem, free.values, free.normal)
        # A larger change, in standard errors of independent blocks, is an active constraint's.
        moved = np.abs(values - free.values) > 1e-3 * np.sqrt(np.diag(free.sensitivity))
        if not moved.any():
            return replace(free, about={**free.about, "constrained": False})
        rises = [residual_rms(problem.rows, problem.completed(v)) for v in (free.values, values)]
        raised = ", ".join(
            f"{joint} {before:.4g} to {after:.4g} N·m"
            for joint, before, after in zip(problem.runs[0][1].joints, *rises, strict=True)
        )
        remark = (
            "least squares alone gives a machine that cannot exist; the nearest that can has a"
            f" larger residual: {raised}. The model lacks an effect: run `exoid diagnose`"
        )
        about = {**free.about, "constrained": True, "least_squares_values": free.values.tolist()}
        return replace(free, values=values, about=about, remarks=(remark,))


def nearest(problem: Problem, values: NDArray, normal: NDArray) -> NDArray:
    """Return the realizable values nearest to some values, in the norm of a normal matrix.

    For least-squares values and their normal matrix, the result has the least residual.

    Parameters
    ----------
    problem : Problem
        Which columns are fitted.
    values : (k,) array
        Values of the free fit.
    normal : (k, k) array
        Normal matrix.

    Returns
    -------
    (k,) array

    Raises
    ------
    NotIdentifiable
        If no realizable values exist.
    """
    # The unit is a standard error of the free fit, so that all numbers are near one.
    size = np.sqrt(np.diag(np.linalg.inv(normal)))
    blocks, cones = zip(*_constraints(problem, values, size), strict=True)
    rows = np.concatenate([slope for slope, _ in blocks])
    bounds = np.concatenate([bound for _, bound in blocks])
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    # Clarabel reads the upper triangle. The free fit is the minimum: no linear term.
    quadratic = csc_matrix(np.triu(normal * np.outer(size, size)))
    # Clarabel's form is A x + s = b with s in the cone, so A is the negative slope.
    solution = clarabel.DefaultSolver(
        quadratic, np.zeros(len(values)), csc_matrix(-rows), bounds, list(cones), settings
    ).solve()
    if str(solution.status) not in ("Solved", "AlmostSolved"):
        raise NotIdentifiable(
            f"no realizable model exists with the values that are held ({solution.status})."
            " Choose --method weighted_least_squares and read its warnings on realizability"
        )
    return values + size * np.array(solution.x)


Constraint = tuple[tuple[NDArray, NDArray], object]


def _constraints(problem: Problem, values: NDArray, size: NDArray) -> Iterator[Constraint]:
    """Yield slope (r, k) and bound (r,) with ``slope @ step + bound`` in a cone, and the cone.

    ``step`` is the step from ``values`` in units of ``size``.
    """
    # Least eigenvalue of a body's inertia form over its trace, so that rounding does not cross the
    # boundary.
    margin = 1e-6
    every = problem.completed(values)
    for form in _inertia_forms(problem):
        # Semidefinite if and only if the least eigenvalue is at least this share of the trace. The
        # bound stays linear in the parameters, as the program requires.
        trace = np.trace(form, axis1=1, axis2=2)[:, np.newaxis, np.newaxis]
        leading = form - margin * trace * np.eye(form.shape[1])
        rows = np.array([_triangle(matrix) for matrix in leading]).T
        yield (
            (rows[:, problem.fitted] * size, rows @ every),
            clarabel.PSDTriangleConeT(form.shape[1]),
        )
    columns = problem.training.layout.columns
    signed = [i for i, place in enumerate(problem.fitted) if columns[place].effect.dissipative]
    if signed:
        yield (np.diag(size)[signed], values[signed]), clarabel.NonnegativeConeT(len(signed))


def _inertia_forms(problem: Problem) -> Iterator[NDArray]:
    """Yield the inertia form (p, m, m) of each fitted body; a real body's is positive definite."""
    run = problem.training.runs[0]
    forms = run.machine.mechanism.inertia_forms(run.geometry)
    layout, fitted = problem.training.layout, set(problem.fitted)
    for places in layout.bodies:
        # A body that is held cannot be moved back, so it is no constraint.
        if fitted & set(places):
            form = np.zeros((layout.size, *forms.shape[1:]))
            form[places] = forms
            yield form


def _triangle(matrix: NDArray) -> Sequence[float]:
    """Return the upper triangle column by column, off-diagonal elements times √2, for Clarabel."""
    n = len(matrix)
    return [
        matrix[i, j] * (1.0 if i == j else np.sqrt(2.0)) for j in range(n) for i in range(j + 1)
    ]
