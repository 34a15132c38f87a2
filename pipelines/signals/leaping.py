"""Whether a motion leaps, as where a record is put together, or values stood still for a while.

A link has mass, so that its speed rises and falls over several samples. A motion that is resolved
by its rows has no single step far longer than all others.
"""

import numpy as np
from numpy.typing import NDArray

from pipelines.signals.resolution import smallest_step

MOST = 10
"""Greatest number of leaps; more are the steps of a coarse or slowly sampled reading."""
FAR = 4.0
"""Least speed of a leap, relative to the highest of all other steps."""


def leaps(time_s: NDArray, values: NDArray) -> NDArray:
    """Return the rows to which a motion leaps, (k,); none where its rows do not resolve it.

    Parameters
    ----------
    time_s : (n,) array
        Times, s.
    values : (n,) array
        Positions in any unit, NaN where missing.
    """
    known = np.flatnonzero(np.isfinite(values))
    steps, passed = np.abs(np.diff(values[known])), np.diff(time_s[known])
    if len(steps) < 10 * MOST or (passed <= 0.0).any():
        return np.array([], dtype=np.intp)
    speeds = steps / passed
    order = np.argsort(speeds)[::-1][: MOST + 1]
    falls = np.flatnonzero(speeds[order[:-1]] > FAR * speeds[order[1:]])
    if not len(falls):
        return np.array([], dtype=np.intp)
    first = np.sort(order[: falls[-1] + 1])
    # A joint at rest that flickers by a count does not leap, however fast that is.
    if steps[first].min() < FAR * smallest_step(values[known]):
        return np.array([], dtype=np.intp)
    # A joint that is moved from stop to stop within a row leaps, too, but does nothing else.
    if steps[first].sum() > np.delete(steps, first).sum():
        return np.array([], dtype=np.intp)
    return known[first + 1]
