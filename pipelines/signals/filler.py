"""A value that stands for missing readings."""

import numpy as np
from numpy.typing import NDArray


def fill_value(values: NDArray) -> float | None:
    """Return a value that stands for missing readings, such as -999 or 1e30; None without one.

    It is the lowest or highest reading, the same in several rows, fewer than half of them, and
    farther from all others than these are from each other.

    Parameters
    ----------
    values : (n,) array
        Readings, NaN where missing.
    """
    known = values[np.isfinite(values)]
    for value in (np.min(known), np.max(known)) if len(known) else ():
        others = known[known != value]
        single = len(others) == len(known) - 1
        if single or len(others) <= len(known) / 2 or np.ptp(others) == 0.0:
            continue
        if np.min(np.abs(others - value)) > np.ptp(others):
            return float(value)
    return None
