"""Sums of products of columns, by output and fold: all that a search over combinations needs.

With Gram matrices in hand a fit of any set of columns costs a solve of that set's size, whatever the
length of the recordings, and its error on a fold that the fit has not seen costs no more.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

PASSES = 3
"""Passes in which outputs are weighted by their own errors."""
RIDGE = 1e-9
"""Of a column's own square: keeps solves of nearly dependent sets finite."""


@dataclass(frozen=True)
class Gram:
    """Products of c columns and the measured torque, O outputs, F folds."""

    columns: NDArray
    """(F, O, c, c)."""
    measured: NDArray
    """(F, O, c)."""
    square: NDArray
    """(F, O) of the measured torque."""
    count: NDArray
    """(F, O) usable blocks."""

    def select(self, chosen: Sequence[int] | NDArray) -> "Gram":
        """Return the products of some of the columns, (k,) places."""
        chosen = np.asarray(chosen)
        return Gram(self.columns[:, :, chosen[:, None], chosen], self.measured[:, :, chosen], self.square, self.count)

    def __add__(self, other: "Gram") -> "Gram":
        """Return the products over both sets of runs."""
        return Gram(
            self.columns + other.columns,
            self.measured + other.measured,
            self.square + other.square,
            self.count + other.count,
        )


def gram_of(columns: NDArray, measured: NDArray, usable: NDArray, fold: NDArray, folds: int) -> Gram:
    """Multiply out one run.

    Parameters
    ----------
    columns : (m, O, c) array
    measured : (m, O) array
    usable : (m, O) array of bool
    fold : (m,) array of int
    """
    _, outputs, c = columns.shape
    by_output = np.zeros((2, folds, outputs))
    out = Gram(np.zeros((folds, outputs, c, c)), np.zeros((folds, outputs, c)), *by_output)
    for f in range(folds):
        for o in range(outputs):
            rows = (fold == f) & usable[:, o]
            if not rows.any():
                continue
            A, y = columns[rows, o], measured[rows, o]
            out.columns[f, o] = A.T @ A
            out.measured[f, o] = A.T @ y
            out.square[f, o] = y @ y
            out.count[f, o] = rows.sum()
    return out


def solve(gram: Gram, weights: NDArray, folds: NDArray | None = None) -> NDArray:
    """Return the coefficients (c,) of the weighted fit on the chosen folds (all of them by default).

    ``weights`` (O,) are the outputs' inverse variances.
    """
    chosen = slice(None) if folds is None else folds
    A = np.einsum("o,foij->ij", weights, gram.columns[chosen])
    b = np.einsum("o,foi->i", weights, gram.measured[chosen])
    size = np.sqrt(np.maximum(np.diag(A), np.finfo(float).tiny))
    scaled = A / np.outer(size, size) + RIDGE * np.eye(len(b))
    return np.linalg.solve(scaled, b / size) / size


def error(gram: Gram, values: NDArray, folds: NDArray | None = None) -> NDArray:
    """Return the sum of squared errors of given coefficients on the chosen folds, (O,)."""
    chosen = slice(None) if folds is None else folds
    quadratic = np.einsum("i,foij,j->o", values, gram.columns[chosen], values)
    linear = np.einsum("i,foi->o", values, gram.measured[chosen])
    return np.maximum(gram.square[chosen].sum(axis=0) - 2 * linear + quadratic, 0.0)


def weights_under(gram: Gram) -> NDArray:
    """Return each output's inverse variance under the fit to all columns, iterated, (O,) 1/(N·m)²."""
    counts = gram.count.sum(axis=0)
    weights = np.where(counts > 0, 1.0, 0.0)
    for _ in range(PASSES):
        squares = error(gram, solve(gram, weights))
        weights = np.where(counts > 0, counts / np.maximum(squares, 1e-9 * np.maximum(counts, 1)), 0.0)
    return weights
