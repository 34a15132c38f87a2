"""Fit smooth curves and surfaces over a run's variables, judged on folds left out of the fit."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from pipelines.diagnosis.evidence.observed_run import FOLDS, Run

if TYPE_CHECKING:
    from pipelines.diagnosis.dependence.explained_share import Variable


@dataclass(frozen=True)
class Curve:
    """Cubic B-splines along one variable, or the products of two variables' splines."""

    variables: tuple["Variable", ...]
    knots: tuple[NDArray, ...]
    joint: int
    degree: int = 3
    """Degree of the splines."""

    @classmethod
    def along(cls, variables: Sequence["Variable"], runs: Sequence[Run], j: int) -> "Curve":
        """Place the knots where equally many blocks lie between two.

        Parameters
        ----------
        variables : sequence of Variable
            One or two.
        runs : sequence of Run
            Runs whose usable blocks count.
        j : int
            Number of the joint.
        """
        knots = []
        for variable in variables:
            values = [(run, variable.of(run, j)) for run in runs]
            known = [x[run.usable[:, j]] for run, x in values if x is not None]
            # Each side of a surface has fewer knots than a curve.
            inner = variable.knots if len(variables) == 1 else 4
            knots.append(_knots(np.concatenate(known), inner, cls.degree))
        return cls(tuple(variables), tuple(knots), j)

    def design(self, run: Run) -> NDArray:
        """Return the splines' values in a run.

        Parameters
        ----------
        run : Run
            m blocks.

        Returns
        -------
        (m, k) array
            Zero where the run lacks a variable.
        """
        design = np.ones((len(run.time), 1))
        for variable, knots in zip(self.variables, self.knots, strict=True):
            x = variable.of(run, self.joint)
            if x is None:
                part = np.zeros((len(run.time), len(knots) - self.degree - 1))
            else:
                # Beyond the outer knots the curve stays
                # constant; a cubic continued there runs away.
                clipped = np.clip(x, knots[0], knots[-1])
                part = BSpline.design_matrix(clipped, knots, self.degree).toarray()
            # Products of each row's splines: a surface has a coefficient for every pair.
            design = (design[:, :, np.newaxis] * part[:, np.newaxis, :]).reshape(len(run.time), -1)
        # Each direction has coefficients of its own, because friction jumps between them.
        if any(variable.by_direction for variable in self.variables):
            forward = run.state[1][:, self.joint, np.newaxis] > 0
            design = np.hstack([design * forward, design * ~forward])
        return design


def _knots(x: NDArray, inner: int, degree: int) -> NDArray:
    # Quantiles of a variable that hardly moves coincide.
    places = np.unique(np.quantile(x, np.linspace(0, 1, inner + 2)))
    if len(places) < 2:
        places = np.array([places[0] - 0.5, places[0] + 0.5])
    # Repeated end knots let the curve take any value at both ends.
    return np.concatenate([[places[0]] * degree, places, [places[-1]] * degree])


@dataclass(frozen=True)
class Products:
    """Products of a design's columns and a residual, fold by fold."""

    columns: NDArray
    """(F, k, k)."""
    right: NDArray
    """(F, k)."""
    square: NDArray
    """(F,)."""

    def fitted(self, ridge: float) -> NDArray:
        """Return the coefficients of a ridge fit to all folds.

        Parameters
        ----------
        ridge : float
            Weight of the penalty.

        Returns
        -------
        (k,) array
            N·m.
        """
        A = self.columns.sum(axis=0)
        return np.linalg.solve(A + _shrinkage(A, np.array(ridge)), self.right.sum(axis=0))

    def held_out(self, ridges: NDArray) -> NDArray:
        """Return the error of ridge fits on folds that were not fitted.

        Parameters
        ----------
        ridges : (r,) array
            Weights of the penalty.

        Returns
        -------
        (r,) array
            Squared errors, (N·m)².
        """
        # A fold without rows has no error to count.
        there = np.flatnonzero(self.square)
        columns, right = self.columns[there], self.right[there]
        # The other folds are the total less the own one, so that no row is multiplied twice.
        others = self.columns.sum(axis=0) - columns
        shrunk = others + _shrinkage(others, ridges[:, np.newaxis])
        rest = np.broadcast_to(self.right.sum(axis=0) - right, (len(ridges), *right.shape))
        c = np.linalg.solve(shrunk, rest[..., np.newaxis])[..., 0]
        # From products alone: |y - A c|² = |y|² - (2 c'A'y - c'A'A c).
        explained = 2.0 * np.sum(c * right, axis=-1) - np.einsum(
            "rfi,fij,rfj->rf", c, columns, c, optimize=True
        )
        return np.sum(self.square[there] - explained, axis=1)


def _shrinkage(A: NDArray, ridges: NDArray) -> NDArray:
    """Return the diagonal matrices that ridges (r, 1) or () add to matrices (..., k, k)."""
    # Relative to the columns' mean square, a penalty has no unit.
    # The least number added keeps a design of zeros solvable.
    size = ridges * np.trace(A, axis1=-2, axis2=-1) / A.shape[-1] + np.finfo(float).tiny
    return np.asarray(size)[..., np.newaxis, np.newaxis] * np.eye(A.shape[-1])


def fold_products(design: NDArray, y: NDArray, partitions: Sequence[NDArray]) -> list[Products]:
    """Return the products of a design and a residual for some partitions of the rows into folds.

    Rows that all partitions put into the same folds are multiplied once.

    Parameters
    ----------
    design : (n, k) array
    y : (n,) array
        Residual, N·m.
    partitions : sequence of (n,) arrays
        Number of each row's fold.

    Returns
    -------
    list of Products
        One for each partition.
    """
    # Rows that share the fold of every partition form a cell; products of cells add up to folds.
    cell = np.ravel_multi_index(tuple(partitions), (FOLDS,) * len(partitions))
    order = np.argsort(cell, kind="stable")
    cells, starts = np.unique(cell[order], return_index=True)
    parts = [(design[rows], y[rows]) for rows in np.split(order, starts[1:])]
    columns, right = np.array([A.T @ A for A, _ in parts]), np.array([A.T @ b for A, b in parts])
    square = np.array([b @ b for _, b in parts])
    folds = np.array(np.unravel_index(cells, (FOLDS,) * len(partitions)))
    products = []
    for own in folds:
        belongs = (own == np.arange(FOLDS)[:, np.newaxis]).astype(float)
        summed = np.tensordot(belongs, columns, axes=1)
        products.append(Products(summed, belongs @ right, belongs @ square))
    return products


def held_out_error(products: Sequence[Products]) -> tuple[float, float]:
    """Return the error of a curve on folds that were not fitted.

    Parameters
    ----------
    products : sequence of Products
        One of each partition, of which the worst counts.

    Returns
    -------
    tuple of float
        Squared error, and the ridge that minimises it.
    """
    # Shrinkage that is tried, in units of a column's mean square.
    ridges = (1e-3, 1e-2, 1e-1, 1.0)
    # A curve must predict other periods and other parts of a period, so the worse of both counts.
    worst = np.max([p.held_out(np.array(ridges)) for p in products], axis=0)
    best = int(np.argmin(worst))
    return float(worst[best]), ridges[best]
