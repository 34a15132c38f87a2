"""Interpolation between evenly spaced samples."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Place = TypeVar("Place", float, NDArray[np.float64])


def cubic_weights(x: Place) -> tuple[Place, Place, Place, Place]:
    """Return the weights of the samples at -1, 0, 1 and 2 for a place between 0 and 1: Lagrange's cubic."""
    return (
        -x * (x - 1) * (x - 2) / 6,
        (x + 1) * (x - 1) * (x - 2) / 2,
        -(x + 1) * x * (x - 2) / 2,
        (x + 1) * x * (x - 1) / 6,
    )
