"""Rows of a long recording that draw the same picture: the extremes of every stretch."""

import numpy as np
from numpy.typing import NDArray


def extremes(columns: NDArray, rows: int) -> NDArray[np.intp]:
    """Return the indices of the rows to keep.

    Rows are cut into equal stretches. Each keeps the rows in which a column has its least or
    greatest value, and one in which it is missing, so that a spike or a gap of one sample survives.
    Rows are kept with all columns; nothing is averaged.

    Parameters
    ----------
    columns : (n, k) array
        Values by row; NaN where one is missing.
    rows : int
        Most rows to keep, unless one stretch needs more.

    Returns
    -------
    (m,) array of int
        Increasing.
    """
    n, k = columns.shape
    if n <= rows:
        return np.arange(n)
    # Three rows per column and stretch: its lowest, its highest, and one without a value. The first
    # and the last row are always kept.
    stretches = max(1, (rows - 2) // (3 * k))
    kept = finer = _of_stretches(columns, stretches)
    # Extremes of smooth curves share rows, which leaves room for more stretches.
    while len(finer) <= rows:
        kept = finer
        stretches *= 2
        finer = _of_stretches(columns, stretches)
    return kept


def _of_stretches(columns: NDArray, stretches: int) -> NDArray[np.intp]:
    """Return the indices of the rows that ``stretches`` equal stretches keep."""
    n = len(columns)
    edges = np.linspace(0, n, stretches + 1).astype(np.intp)
    length = int(np.diff(edges).max())
    # Stretches have equal length here: a shorter one repeats its last row.
    index = np.minimum(edges[:-1, np.newaxis] + np.arange(length), edges[1:, np.newaxis] - 1)
    kept = [np.array([0, n - 1])]
    first = edges[:-1]
    for column in columns.T:
        values = column[index]
        missing = np.isnan(values)
        has_gap = missing.any(axis=1)
        kept += [
            first + np.argmin(np.where(missing, np.inf, values), axis=1),
            first + np.argmax(np.where(missing, -np.inf, values), axis=1),
            first[has_gap] + np.argmax(missing, axis=1)[has_gap],
        ]
    return np.unique(np.minimum(np.concatenate(kept), n - 1))
