"""Interpolation between samples."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

Place = TypeVar("Place", float, NDArray[np.float64])


def cubic_weights(x: Place) -> tuple[Place, Place, Place, Place]:
    """Return the weights of the samples at -1, 0, 1 and 2 for a place between 0 and 1: Lagrange's
    cubic."""
    return (
        -x * (x - 1) * (x - 2) / 6,
        (x + 1) * (x - 1) * (x - 2) / 2,
        -(x + 1) * x * (x - 2) / 2,
        (x + 1) * x * (x - 1) / 6,
    )


def between_readings(x: NDArray, longest: int) -> NDArray:
    """Return what is read only now and then at every sample, (n, k), along Akima's curve through
    its readings.

    Parameters
    ----------
    x : NDArray
        (n, k); a row with a NaN is no reading.
    longest : int
        Readings further apart than so many samples tell nothing of what is between them: NaN.
    """
    read = np.flatnonzero(np.isfinite(x).all(axis=1))
    if len(read) in (0, 1, len(x)):
        return x
    every = np.arange(len(x))
    interpolated: NDArray = Akima1DInterpolator(read, x[read])(every)
    later = np.searchsorted(read, every).clip(1, len(read) - 1)
    interpolated[read[later] - read[later - 1] > longest] = np.nan
    interpolated[read] = x[read]
    return interpolated
