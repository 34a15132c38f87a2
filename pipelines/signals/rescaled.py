"""Whether a channel's decimal point moves, as that of a display or meter with several ranges.

Its digits are then read with a factor of ten too many or too few while another range is chosen. The
channel leaps by a factor of ten, goes on from there, and leaps back.
"""

import numpy as np
from numpy.typing import NDArray

LEAPS = 2
"""Least number of leaps up, and of leaps down."""
SHARE = 0.25
"""Least share of all leaps that are by a factor of ten; friction leaps, too, but by any factor."""


def is_rescaled(values: NDArray) -> bool:
    """Return whether values leap by a factor of ten, and back.

    Parameters
    ----------
    values : (n,) array
        New readings in a row, in any unit, zero where the quantity is zero; NaN where missing.
    """
    # A leap is several times the steps around it. What moves meanwhile changes its factor a little.
    far, tolerance = 4.0, 0.1
    known = values[np.isfinite(values) & (values != 0.0)]
    steps = np.abs(np.diff(known))
    if len(steps) < 3:
        return False
    leaps = steps[1:-1] > far * np.maximum(steps[:-2], steps[2:])
    before, after = known[1:-2][leaps], known[2:-1][leaps]
    powers = np.where(before * after > 0.0, np.log10(np.abs(after / before)), 0.0)
    up, down = (np.abs(powers - power) < tolerance for power in (1.0, -1.0))
    by_ten = np.count_nonzero(up | down)
    return bool(
        min(np.count_nonzero(up), np.count_nonzero(down)) >= LEAPS and by_ten >= SHARE * len(powers)
    )
