"""Interpolate between samples."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Place = TypeVar("Place", float, NDArray[np.float64])


def cubic_weights(x: Place) -> tuple[Place, Place, Place, Place]:
    """Return the weights of Lagrange's cubic interpolation.

    Parameters
    ----------
    x : float or (n,) array
        Position between the samples at 0 and 1.

    Returns
    -------
    four of float or (n,) array
        Weights of the samples at -1, 0, 1 and 2.
    """
    return (
        -x * (x - 1) * (x - 2) / 6,
        (x + 1) * (x - 1) * (x - 2) / 2,
        -(x + 1) * x * (x - 2) / 2,
        (x + 1) * x * (x - 1) / 6,
    )


def between_readings(x: NDArray, longest: int) -> NDArray:
    """Interpolate a slowly read quantity to every sample, along Akima's curve.

    Parameters
    ----------
    x : (n, k) array
        Readings; a row with a NaN is no reading.
    longest : int
        Longest interval between two readings that is filled, in samples; longer ones are NaN.

    Returns
    -------
    (n, k) array
        Interpolated values; ``x`` itself if it has fewer than two readings, or one at every sample.
    """
    from scipy.interpolate import Akima1DInterpolator

    read = np.flatnonzero(np.isfinite(x).all(axis=1))
    if len(read) in (0, 1, len(x)):
        return x
    every = np.arange(len(x))
    # Akima's curve is local: a jump of one reading does not ring through all others, as in a
    # spline. Before the first reading and after the last it is NaN.
    interpolated: NDArray = Akima1DInterpolator(read, x[read])(every)
    later = np.searchsorted(read, every).clip(1, len(read) - 1)
    interpolated[read[later] - read[later - 1] > longest] = np.nan
    # A reading is valid itself, even where the interval before it was too long to fill.
    interpolated[read] = x[read]
    return interpolated
