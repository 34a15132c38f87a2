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
"""Rows whose means are judged: more of them have less noise, and fewer a sharper turn. All of them
count together."""


def is_folded(values: NDArray) -> bool:
    """Return whether values turn round at zero as a magnitude does.

    Parameters
    ----------
    values : (n,) array
        New readings in a row, in any unit, zero where the quantity is zero; NaN where missing.
    """
    known = values[np.isfinite(values)]
    lengths = [length for length in LENGTHS if len(known) >= 4 * length]
    if not lengths:
        return False
    # Where means of many rows do not resolve a turn, single rows go through zero.
    rows, turned = (
        np.concatenate(parts)
        for parts in zip(*(_crossings(known, length) for length in lengths), strict=True)
    )
    # One crossing may show at several lengths, each within a few of its rows.
    apart = len(np.unique(rows // (2 * LENGTHS[-1])))
    return bool(apart >= CROSSINGS and np.mean(turned) >= SHARE)


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


def _crossings(known: NDArray, length: int) -> tuple[NDArray, NDArray]:
    """Return the crossings that means over some rows of values (n,) come to.

    Returns
    -------
    rows : (k,) array
        The row of each.
    turned : (k,) array
        Whether values turn round there instead.
    """
    values = known[: len(known) // length * length].reshape(-1, length).mean(axis=1)
    step = smallest_step(np.abs(values))
    before, here, after = values[1:-2], values[2:-1], values[3:]
    ahead = 2.0 * here - before
    # Noise and the smallest step let values turn round without any crossing.
    noise = float(np.median(np.abs(after - ahead)))
    # As if all came from above.
    side = np.sign(here)
    ahead, after = side * ahead, side * after
    # A spike to zero and back turns round, too, but did not come on a straight line.
    came_straight = np.abs(values[:-3] - 2.0 * before + here) < 0.7 * np.abs(here - before)
    crosses = (ahead < -2.0 * max(step, noise)) & came_straight
    return (np.flatnonzero(crosses) + 3) * length, after[crosses] > -0.5 * ahead[crosses]
