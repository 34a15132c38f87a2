"""The running mean of one quantity along another: what stands in equally wide bins, averaged."""

import numpy as np
from numpy.typing import NDArray

BINS, FEWEST = 40, 8
"""Of a running mean, and the values that a bin needs to have one."""


def binned_mean(x: NDArray, y: NDArray, low: float, high: float) -> tuple[NDArray, NDArray]:
    """Return the mean of a quantity in equally wide bins along another.

    Parameters
    ----------
    x, y : (n,) array
        Any order; what lies outside the bins is left out.
    low, high : float
        Where the bins begin and end, in the unit of ``x``.

    Returns
    -------
    middles, means : (BINS,) array
        NaN where fewer than ``FEWEST`` values are.
    """
    edges = np.linspace(low, high, BINS + 1)
    number = np.searchsorted(edges, x, side="right") - 1
    number = np.where(x == high, BINS - 1, number)  # the last bin has both its ends
    inside = (number >= 0) & (number < BINS)
    count = np.bincount(number[inside], minlength=BINS)
    total = np.bincount(number[inside], y[inside], BINS)
    return 0.5 * (edges[1:] + edges[:-1]), np.where(count >= FEWEST, total / np.maximum(count, 1), np.nan)
