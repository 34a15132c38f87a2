"""The running mean of one quantity along another: what stands in equally wide bins, averaged."""

import numpy as np
from numpy.typing import NDArray

BINS, FEWEST = 40, 8
"""Of a running mean, and the values that a mean is of at least."""


def binned_mean(x: NDArray, y: NDArray, low: float, high: float) -> tuple[NDArray, NDArray]:
    """Return the mean of a quantity in equally wide bins along another, neighbours joined until
    each has enough.

    Enough is half of what bins have on average, and ``FEWEST``.

    Parameters
    ----------
    x, y : (n,) array
        Any order; what lies outside the bins is left out.
    low, high : float
        Where the bins begin and end, in the unit of ``x``.

    Returns
    -------
    places, means : (k,) array
        Means of ``x`` and of ``y``, k from 0, where all bins together hold too few, to ``BINS``.
    """
    edges = np.linspace(low, high, BINS + 1)
    number = np.searchsorted(edges, x, side="right") - 1
    number = np.where(x == high, BINS - 1, number)  # the last bin has both its ends
    inside = (number >= 0) & (number < BINS)
    sums = np.array(
        [np.bincount(number[inside], weights, BINS) for weights in (None, x[inside], y[inside])]
    )
    enough = max(FEWEST, inside.sum() / (2 * BINS))
    joined: list[NDArray] = [np.zeros(3)]
    for bin_sums in sums.T:
        if joined[-1][0] >= enough:
            joined.append(np.zeros(3))
        joined[-1] = joined[-1] + bin_sums
    if joined[-1][0] < enough:  # what is left over at the end goes with those before
        rest = joined.pop()
        if joined:
            joined[-1] = joined[-1] + rest
    count, of_x, of_y = np.array(joined).reshape(-1, 3).T
    return of_x / count, of_y / count
