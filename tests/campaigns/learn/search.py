"""Learning: coordinate steps of logarithms that raise a score, shortened as they fail."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FIRST_STEP, LAST_STEP = 0.7, 0.15
"""Steps of a logarithm, at first and at last."""

Score = Callable[[NDArray], tuple[float, NDArray]]


def ascend(
    score: Score,
    start: NDArray,
    report: Callable[[int, float], None] = lambda place, value: None,
) -> tuple[NDArray, float, NDArray]:
    """Return the best vector, its score, and the details of the score there."""
    best, (value, details), step = start.copy(), score(start), FIRST_STEP
    last = np.ones(len(start))
    while step > LAST_STEP:
        for place in range(len(start)):
            for way in (last[place], -last[place]):
                tried = best.copy()
                tried[place] += way * step
                now, also = score(tried)
                if now > value:
                    best, value, details = tried, now, also
                    last[place] = way
                    report(place, value)
                    break
        step *= 0.6
    return best, value, details
