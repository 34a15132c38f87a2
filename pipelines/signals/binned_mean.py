"""Average one quantity over equally wide bins of another."""

import numpy as np
from numpy.typing import NDArray

FEWEST = 8
"""Least number of values in a mean."""


def binned_mean(
    x: NDArray, y: NDArray, low: float, high: float, bins: int = 40
) -> tuple[NDArray, NDArray]:
    """Average a quantity in equally wide bins along another.

    Neighbouring bins are joined until each holds enough values: half the average number per bin,
    and at least ``FEWEST``.

    Parameters
    ----------
    x, y : (n,) array
        Positions and values, in any order. Values outside the bins are ignored.
    low, high : float
        Start of the first bin and end of the last, in the unit of ``x``.
    bins : int, optional
        Number of bins.

    Returns
    -------
    positions, means : (k,) array
        Means of ``x`` and of ``y``; k is at most ``bins``, and 0 if all bins together hold too few.
    """
    edges = np.linspace(low, high, bins + 1)
    number = np.searchsorted(edges, x, side="right") - 1
    number = np.where(x == high, bins - 1, number)  # The last bin includes both ends.
    inside = (number >= 0) & (number < bins)
    sums = np.array(
        [np.bincount(number[inside], weights, bins) for weights in (None, x[inside], y[inside])]
    )
    # A mean of few values is mostly noise, so sparse bins are joined.
    enough = max(FEWEST, inside.sum() / (2 * bins))
    joined: list[NDArray] = [np.zeros(3)]
    for bin_sums in sums.T:
        if joined[-1][0] >= enough:
            joined.append(np.zeros(3))
        joined[-1] = joined[-1] + bin_sums
    if joined[-1][0] < enough:  # The last bins join the mean before them.
        rest = joined.pop()
        if joined:
            joined[-1] = joined[-1] + rest
    count, of_x, of_y = np.array(joined).reshape(-1, 3).T
    # The mean of x and not a bin's middle: values may crowd at one end of a joined bin.
    return of_x / count, of_y / count
