"""Whether a channel holds the magnitude of a quantity whose sign was recorded elsewhere, or lost.

A quantity that crosses zero goes on as it came. Its magnitude turns round there as sharply as it
came: the next value lies where a straight line through the two before leads, but for the sign. A
channel that ends at zero stays there, and one that only touches zero turns round smoothly.
"""

import numpy as np
from numpy.typing import NDArray

CROSSINGS = 4
"""Least number of crossings of zero that are judged."""
SHARE = 0.75
"""Least share of them after which a magnitude goes on with the other sign.

It is halfway between all of them, as of a magnitude, and the half at which values that touch zero
smoothly seem to do so.
"""
LENGTHS = (1, 2, 4, 8)
"""Rows whose means are judged: more of them have less noise, and fewer a sharper turn."""


def is_folded(values: NDArray) -> bool:
    """Return whether values of one sign turn round at zero as a magnitude does.

    Parameters
    ----------
    values : (n,) array
        New readings in a row, in any unit, zero where the quantity is zero; NaN where missing.
    """
    known = values[np.isfinite(values)]
    if not (np.all(known >= 0.0) or np.all(known <= 0.0)):
        return False
    size = np.abs(known)
    lengths = (length for length in LENGTHS if len(size) >= 3 * length)
    return any(
        _turns_round(size[: len(size) // length * length].reshape(-1, length).mean(axis=1))
        for length in lengths
    )


def _turns_round(size: NDArray) -> bool:
    """Return whether values (n,) of zero and above turn round at zero as sharply as they came."""
    steps = np.diff(np.unique(size))
    # Differences by rounding in float64 are no steps.
    steps = steps[steps > 1e-9 * size.max()]
    ahead = 2.0 * size[1:-1] - size[:-2]
    # Noise and the smallest step let values turn round without any crossing.
    noise = float(np.median(np.abs(size[2:] - ahead)))
    crosses = ahead < -2.0 * max(steps.min(initial=np.inf), noise)
    far, came = -ahead[crosses], size[2:][crosses]
    goes_on = came > 0.5 * far
    return bool(len(far) >= CROSSINGS and np.mean(goes_on) >= SHARE)
