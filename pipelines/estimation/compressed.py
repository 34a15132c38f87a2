"""Compress the rows of a regression to as few as it has columns.

Every fit with one weight per joint follows from the compressed rows: the residuals of any fit have
the same sum of squares in both, and no digits are lost by squaring. Rows that arrive piece by piece
are compressed as they pass (Golub and Van Loan, Matrix Computations, 5.3): triangles of pieces are
stacked and made one triangle again, as in Demmel et al. (2012), SIAM J. Sci. Comput. 34(1).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from pipelines.estimation.regression import Regression


@dataclass(frozen=True)
class CompressedRows:
    """Usable rows of some runs, r per joint: ``torque = regressor @ parameters + noise``."""

    regressor: NDArray
    """(J, r, p) N·m per unit."""
    torque: NDArray
    """(J, r) N·m."""
    count: NDArray
    """(J,) number of rows before compression."""


def compress(regressions: Iterable[Regression]) -> CompressedRows:
    """Compress the usable rows of all pieces of some runs.

    Parameters
    ----------
    regressions : iterable of Regression
        Pieces with the same J joints and p columns, at least one.

    Returns
    -------
    CompressedRows
        At most p + 1 rows per joint, zeros where a joint has fewer.
    """
    triangles: list[NDArray] = []
    count: NDArray | int = 0
    for r in regressions:
        # With the torque as last column the triangle also holds the residual of every fit.
        rows = np.concatenate([r.regressor, r.torque[:, :, np.newaxis]], axis=2)
        triangles = triangles or [np.zeros((0, rows.shape[2]))] * rows.shape[1]
        for j, triangle in enumerate(triangles):
            # The old triangle with new rows has the same R as all rows together (Demmel et al.,
            # 2012). scipy fills the rows below the triangle with zeros; they are cut off.
            stacked = np.concatenate([triangle, rows[r.usable[:, j], j]])
            triangles[j] = qr(stacked, mode="r")[0][: rows.shape[2]]
        count = count + r.usable.sum(axis=0)
    # A joint with few usable rows has fewer than there are columns; zeros fill them up.
    width = triangles[0].shape[1]
    every = np.stack([np.pad(t, ((0, width - len(t)), (0, 0))) for t in triangles])
    return CompressedRows(every[:, :, :-1], every[:, :, -1], np.asarray(count))


def together(parts: Sequence[CompressedRows]) -> CompressedRows:
    """Return the rows of several regressions as one.

    Parameters
    ----------
    parts : sequence of CompressedRows
        Of the same J joints and p columns.

    Returns
    -------
    CompressedRows
        With all rows of ``parts``; counts are added.
    """
    return CompressedRows(
        np.concatenate([part.regressor for part in parts], axis=1),
        np.concatenate([part.torque for part in parts], axis=1),
        np.sum([part.count for part in parts], axis=0),
    )


def normal_equations(rows: CompressedRows, weights: NDArray) -> tuple[NDArray, NDArray]:
    """Return the normal equations over all usable rows.

    Parameters
    ----------
    rows : CompressedRows
        Rows of J joints on p columns.
    weights : (J,) array
        Weight of each joint.

    Returns
    -------
    gram : (p, p) array
        A'WA.
    right : (p,) array
        A'W tau.
    """
    gram = np.einsum("j,jri,jrk->ik", weights, rows.regressor, rows.regressor)
    return gram, np.einsum("j,jri,jr->i", weights, rows.regressor, rows.torque)


def residual_rms(rows: CompressedRows, values: NDArray) -> NDArray:
    """Return the root mean square residual of each joint over usable rows, (J,) N·m.

    Parameters
    ----------
    rows : CompressedRows
        Rows of J joints on p columns.
    values : (p,) array
        Parameters.
    """
    residual = rows.torque - rows.regressor @ values
    # Compression keeps the sum of squares, so the mean is over the number of original rows.
    return np.sqrt(np.sum(residual**2, axis=1) / np.maximum(rows.count, 1))
