"""Values at which a channel is cut off, as by an amplifier, an input or a scaled percentage.

Such an end may lie anywhere within the range of the register. A channel that is cut off comes to it
at full slope, and stays there to the last digit. One that turns round, or settles, comes ever
slower, and one that friction makes leap has no slope before it.
"""

import numpy as np
from numpy.typing import NDArray

from pipelines.signals.resolution import smallest_step

ROWS = 3
"""Least number of equal values in a row."""
TIMES = 2
"""Least number of times that a channel is cut off at one value."""
QUANTA = 3.0
"""Least slope of a channel that is cut off, in smallest steps a row."""
EVEN = 2.0
"""Largest ratio between two steps of a slope."""


def cut_off_at(values: NDArray) -> tuple[float, ...]:
    """Return the extreme values at which a channel is cut off.

    Parameters
    ----------
    values : (n,) array
        Readings in a row, in any unit; NaN where missing.
    """
    known = values[np.isfinite(values)]
    if len(known) < ROWS:
        return ()
    quantum = smallest_step(known)
    return tuple(
        float(end)
        for end, side in ((known.min(), -1.0), (known.max(), 1.0))
        if _times(side * known, side * end, quantum) >= TIMES
    )


def _times(values: NDArray, end: float, quantum: float) -> int:
    """Return how often values (n,) rise to their highest at full slope, and stay there."""
    is_end = np.concatenate([[False], values == end, [False]])
    begins = np.flatnonzero(is_end[1:-1] & ~is_end[:-2])
    ends = np.flatnonzero(is_end[1:-1] & ~is_end[2:]) + 1
    begins = begins[(ends - begins >= ROWS) & (begins >= 3)]
    # The last step is cut short, so that the two before it show the slope.
    before, slope = (values[begins - k] - values[begins - k - 1] for k in (2, 1))
    last = end - values[begins - 1]
    steep = (slope >= QUANTA * quantum) & (last <= EVEN * slope)
    even = (before <= EVEN * slope) & (slope <= EVEN * before)
    return int(np.count_nonzero(steep & even))
