"""Sum the products of columns, by output, as every weighted fit needs them.

With Gram matrices a fit of any set of columns costs a solve of that set's size, whatever the length
of the recordings.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Gram:
    """Products of c columns and the measured torque, O outputs."""

    columns: NDArray
    """(O, c, c)."""
    measured: NDArray
    """(O, c)."""
    square: NDArray
    """(O,) of the measured torque."""
    count: NDArray
    """(O,) usable blocks."""

    def __add__(self, other: "Gram") -> "Gram":
        """Return the products over both sets of runs."""
        return Gram(
            self.columns + other.columns,
            self.measured + other.measured,
            self.square + other.square,
            self.count + other.count,
        )


def gram_of(columns: NDArray, measured: NDArray, usable: NDArray) -> Gram:
    """Return the Gram matrices of one run.

    Parameters
    ----------
    columns : (m, O, c) array
    measured : (m, O) array
        N·m.
    usable : (m, O) array of bool
    """
    _, outputs, c = columns.shape
    out = Gram(
        np.zeros((outputs, c, c)), np.zeros((outputs, c)), np.zeros(outputs), np.zeros(outputs)
    )
    for o in range(outputs):
        rows = usable[:, o]
        A, y = columns[rows, o], measured[rows, o]
        out.columns[o] = A.T @ A
        out.measured[o] = A.T @ y
        out.square[o] = y @ y
        out.count[o] = rows.sum()
    return out


def solve(gram: Gram, weights: NDArray) -> NDArray:
    """Return the coefficients (c,) of the weighted fit.

    Parameters
    ----------
    gram : Gram
    weights : (O,) array
        The outputs' inverse variances, 1/(N·m)².
    """
    A = np.einsum("o,oij->ij", weights, gram.columns)
    b = np.einsum("o,oi->i", weights, gram.measured)
    # At unit length the ridge shrinks all columns alike, whatever their units.
    size = np.sqrt(np.maximum(np.diag(A), np.finfo(float).tiny))
    # Relative to a column's square: keeps solves of nearly dependent sets finite.
    ridge = 1e-9
    scaled = A / np.outer(size, size) + ridge * np.eye(len(b))
    return np.linalg.solve(scaled, b / size) / size


def error(gram: Gram, values: NDArray) -> NDArray:
    """Return each output's sum of squared errors.

    Parameters
    ----------
    gram : Gram
        Products of c columns at O outputs.
    values : (c,) array
        Coefficients.

    Returns
    -------
    (O,) array
        (N·m)².
    """
    quadratic = np.einsum("i,oij,j->o", values, gram.columns, values)
    linear = np.einsum("i,oi->o", values, gram.measured)
    # Rounding can make this difference of large squares negative.
    return np.maximum(gram.square - 2 * linear + quadratic, 0.0)


def weights_under(gram: Gram) -> NDArray:
    """Return each output's inverse variance under the fit to all columns.

    The fit is weighted by these variances, and iterated.

    Parameters
    ----------
    gram : Gram
        Products of c columns at O outputs.

    Returns
    -------
    (O,) array
        1/(N·m)²; zero without usable blocks.
    """
    weights = np.where(gram.count > 0, 1.0, 0.0)
    for _ in range(3):
        squares = error(gram, solve(gram, weights))
        # An output without any error would have infinite weight.
        least = 1e-9 * np.maximum(gram.count, 1)
        weights = np.where(gram.count > 0, gram.count / np.maximum(squares, least), 0.0)
    return weights
