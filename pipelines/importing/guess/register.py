"""Registers that were logged without their sign."""

import numpy as np
from numpy.typing import NDArray

FEW = 0.001
"""Share of rows in the upper half of a register that make it a signed one; a single one may be a
slip."""


def are_whole(values: NDArray) -> bool:
    """Tell whether values (n,) are whole numbers, but for a slip here and there."""
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool(np.mean(known == np.round(known)) > 0.99)


def lost_sign(values: NDArray) -> int | None:
    """Return the bits of a signed register, (n,), that was logged as if it had none; None where it
    was not.

    Its values are whole, never negative, and in the upper half as well as near zero, with next to
    nothing between.
    """
    known = values[np.isfinite(values)]
    if np.any(known < 0) or not are_whole(known):
        return None
    for bits in (16, 32):
        full = 2.0**bits
        # A little beyond, for digits that a float32 has lost; what is far beyond is no register's.
        held = known[known <= 1.0001 * full]
        upper = np.count_nonzero(held >= full / 2)
        lower = np.count_nonzero(held < full / 2)
        empty = np.count_nonzero((held > 0.4 * full) & (held < 0.6 * full)) < 0.01 * len(known)
        common = upper >= FEW * len(known) or (bits == 32 and upper)
        if common and lower and empty and len(held) > 0.98 * len(known):
            return bits
    return None
