"""Whether a channel holds the magnitude of a quantity whose sign was recorded elsewhere, or lost.

A quantity that crosses zero goes on as it came. Its magnitude turns round there as sharply as it
came: the next value lies where a straight line through the two before leads, but for the sign. A
channel that ends at zero stays there, and one that only touches zero turns round smoothly. A
magnitude with the sign of something else turns round at zero, too, and leaps elsewhere.
"""

import numpy as np
from numpy.typing import NDArray

from pipelines.signals.resolution import smallest_step

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
    """Return whether values turn round at zero as a magnitude does.

    Parameters
    ----------
    values : (n,) array
        New readings in a row, in any unit, zero where the quantity is zero; NaN where missing.
    """
    known = values[np.isfinite(values)]
    lengths = (length for length in LENGTHS if len(known) >= 3 * length)
    return any(
        _turns_round(known[: len(known) // length * length].reshape(-1, length).mean(axis=1))
        for length in lengths
    )


def is_folded_angle(values: NDArray) -> bool:
    """Return whether an angle turns round at zero as a magnitude does.

    Parameters
    ----------
    values : (n,) array
        New readings in a row, in any unit, zero where the angle is zero; NaN where missing.
    """
    known = values[np.isfinite(values)]
    if len(known) < 2:
        return False
    # A counter that starts again at zero steps by its whole range there.
    starts_again = np.max(np.abs(np.diff(known))) > 0.5 * np.ptp(known)
    return not starts_again and is_folded(known)


def _turns_round(values: NDArray) -> bool:
    """Return whether values (n,) turn round at zero as sharply as they came."""
    step = smallest_step(np.abs(values))
    ahead = 2.0 * values[1:-1] - values[:-2]
    # Noise and the smallest step let values turn round without any crossing.
    noise = float(np.median(np.abs(values[2:] - ahead)))
    # As if all came from above.
    side = np.sign(values[1:-1])
    ahead, after = side * ahead, side * values[2:]
    crosses = ahead < -2.0 * max(step, noise)
    far, came = -ahead[crosses], after[crosses]
    goes_on = came > 0.5 * far
    return bool(len(far) >= CROSSINGS and np.mean(goes_on) >= SHARE)
