"""Smooth curves and surfaces of what a run knows, and their error on folds they were not fitted to."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from pipelines.diagnosis.evidence.observed_run import FOLDS, Run

if TYPE_CHECKING:
    from pipelines.diagnosis.dependence.explained_share import Variable

DEGREE = 3
FEWER = 4
"""Inner knots of each side of a surface."""
RIDGES = (1e-3, 1e-2, 1e-1, 1.0)
"""Shrinkage that is tried, in units of a column's mean square."""


@dataclass(frozen=True)
class Curve:
    """Cubic B-splines along one variable, or the products of two variables' splines."""

    variables: tuple["Variable", ...]
    knots: tuple[NDArray, ...]
    joint: int

    @classmethod
    def along(cls, variables: Sequence["Variable"], runs: Sequence[Run], j: int) -> "Curve":
        """Place the knots where equally many blocks lie between two."""
        knots = []
        for variable in variables:
            known = [(x[run.usable[:, j]]) for run in runs if (x := variable.of(run, j)) is not None]
            knots.append(_knots(np.concatenate(known), variable.knots if len(variables) == 1 else FEWER))
        return cls(tuple(variables), tuple(knots), j)

    def design(self, run: Run) -> NDArray:
        """Return the splines' values in a run, (m, k); nought where the run does not know a variable."""
        design = np.ones((len(run.time), 1))
        for variable, knots in zip(self.variables, self.knots, strict=True):
            x = variable.of(run, self.joint)
            if x is None:
                part = np.zeros((len(run.time), len(knots) - DEGREE - 1))
            else:
                clipped = np.clip(x, knots[0], knots[-1])
                part = BSpline.design_matrix(clipped, knots, DEGREE).toarray()
            design = (design[:, :, np.newaxis] * part[:, np.newaxis, :]).reshape(len(run.time), -1)
        if any(variable.by_direction for variable in self.variables):
            forward = run.state[1][:, self.joint, np.newaxis] > 0
            design = np.hstack([design * forward, design * ~forward])
        return design


def _knots(x: NDArray, inner: int) -> NDArray:
    # A variable that hardly moves would have several knots in one place.
    places = np.unique(np.quantile(x, np.linspace(0, 1, inner + 2)))
    if len(places) < 2:
        places = np.array([places[0] - 0.5, places[0] + 0.5])
    return np.concatenate([[places[0]] * DEGREE, places, [places[-1]] * DEGREE])


@dataclass(frozen=True)
class Products:
    """Products of a design's columns and a residual, fold by fold."""

    columns: NDArray
    """(F, k, k)."""
    right: NDArray
    """(F, k)."""
    square: NDArray
    """(F,)."""

    def solve(self, folds: Sequence[int], ridge: float) -> NDArray:
        """Return the coefficients (k,) of a ridge fit to some folds."""
        A = self.columns[list(folds)].sum(axis=0)
        scale = np.trace(A) / len(A)
        shrunk = A + (ridge * scale + np.finfo(float).tiny) * np.eye(len(A))
        return np.linalg.solve(shrunk, self.right[list(folds)].sum(axis=0))


def fold_products(design: NDArray, y: NDArray, fold: NDArray) -> Products:
    """Multiply out a design (n, k) and a residual (n,), whose rows belong to folds (n,)."""
    parts = [(design[fold == f], y[fold == f]) for f in range(FOLDS)]
    columns, right = np.array([A.T @ A for A, _ in parts]), np.array([A.T @ b for A, b in parts])
    return Products(columns, right, np.array([b @ b for _, b in parts]))


def held_out_error(products: Sequence[Products]) -> tuple[float, float]:
    """Return the squared error on folds that were not fitted, and the ridge that makes it least.

    Of several ways to deal out the folds the worst counts.
    """
    return min((max(_held_out(p, ridge) for p in products), ridge) for ridge in RIDGES)


def _held_out(products: Products, ridge: float) -> float:
    total = 0.0
    for f in np.flatnonzero(products.square):
        c = products.solve([g for g in range(FOLDS) if g != f], ridge)
        total += float(products.square[f] - 2 * c @ products.right[f] + c @ products.columns[f] @ c)
    return total
