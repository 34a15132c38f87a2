"""Values that are held until new ones come: rows faster than the bus."""

import numpy as np
from numpy.typing import NDArray

from pipelines.signals.resolution import smallest_step

MANY = 10
"""Least number of new values."""


def new_values(values: NDArray) -> NDArray:
    """Return the rows in which a value differs from the last one, (k,).

    Parameters
    ----------
    values : (n,) array
        In any unit, NaN where missing.
    """
    known = np.flatnonzero(np.isfinite(values))
    return known[np.diff(values[known], prepend=np.nan) != 0.0]


def are_held(values: NDArray) -> bool:
    """Return whether values repeat because new ones come less often than rows.

    Coarse readings repeat, too, but go on by their smallest step. Held ones jump over many.

    Parameters
    ----------
    values : (n,) array
        In any unit, NaN where missing.
    """
    # Rows without a value repeat nothing.
    values = values[np.isfinite(values)]
    new = new_values(values)
    if len(new) < MANY:
        return False
    # A joint that rests, or a torque that is cut off, repeats its values, too. A stretch of rows
    # counts once, however long it is.
    repeats = float(np.mean(np.diff(new) > 1))
    # From the lowest on, as a large offset has no share in their rounding.
    step = smallest_step(values[new] - values[new].min())
    if np.isinf(step):
        return False
    jump = float(np.median(np.abs(np.diff(values[new])))) / step
    # Noise with a median jump of k steps repeats a reading by chance in about one of 4 k values. A
    # share four times as large, with a margin of 5 %, is not chance.
    return bool(repeats > 0.05 + 1.0 / jump)
