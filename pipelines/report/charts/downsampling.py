"""Rows of a long recording that draw the same picture: in every stretch, those where a column is
lowest or highest."""

import numpy as np
from numpy.typing import NDArray

EACH = 3
"""Rows that a column needs of a stretch: its lowest, its highest, and one where it is missing."""


def extremes(columns: NDArray, rows: int) -> NDArray[np.intp]:
    """Return the numbers of the rows to keep, rising, at most ``rows`` of them (two, and those that
    one stretch needs).

    Rows are cut into equal stretches. Of each the rows stay in which any column has its least or
    its greatest value, and one in which it is missing, so that a spike or a gap of one sample
    survives. Every row that stays is one that was measured, with all its columns: nothing is
    averaged or made up.

    Parameters
    ----------
    columns : (n, k) array
        Values by row; NaN where one is missing.
    rows : int
        How many rows may stay.
    """
    n, k = columns.shape
    if n <= rows:
        return np.arange(n)
    stretches = max(1, (rows - 2) // (EACH * k))
    kept = _of_stretches(columns, stretches)
    # Extremes of smooth curves stand in the same rows, so there is room for more stretches.
    while len(finer := _of_stretches(columns, stretches := 2 * stretches)) <= rows:
        kept = finer
    return kept


def _of_stretches(columns: NDArray, stretches: int) -> NDArray[np.intp]:
    """Return the rows that so many stretches keep."""
    n = len(columns)
    edges = np.linspace(0, n, stretches + 1).astype(np.intp)
    length = int(np.diff(edges).max())
    # Every stretch as long as the longest: the last row of a shorter one stands twice.
    place = np.minimum(edges[:-1, np.newaxis] + np.arange(length), edges[1:, np.newaxis] - 1)
    kept = [np.array([0, n - 1])]
    first = edges[:-1]
    for column in columns.T:
        values = column[place]
        missing = np.isnan(values)
        for chosen in (
            np.argmin(np.where(missing, np.inf, values), axis=1),
            np.argmax(np.where(missing, -np.inf, values), axis=1),
            np.argmax(missing, axis=1)[missing.any(axis=1)],
        ):
            begin = first if len(chosen) == stretches else first[missing.any(axis=1)]
            kept.append(begin + chosen)
    return np.unique(np.minimum(np.concatenate(kept), n - 1))
