"""Learning: coordinate steps that raise the mean log probability of the truth, halved as they fail."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FIRST_STEP, LAST_STEP = 0.5, 0.06
"""Steps of a logarithm or of a log odds over four, at first and at last."""
ODDS = 3.0
"""How many times larger a step of log odds is than one of a logarithm."""


def ascend(
    score: Callable[[NDArray], float],
    start: NDArray,
    scale: NDArray,
    report: Callable[[int, float], None] = lambda place, value: None,
) -> tuple[NDArray, float]:
    """Return the best vector found, and its score; ``scale`` (n,) is each place's unit step."""
    best, value = start.copy(), score(start)
    step = FIRST_STEP
    last = np.zeros(len(start))
    while step > LAST_STEP:
        gained = False
        for place in range(len(start)):
            for way in _ways(last[place]):
                tried = best.copy()
                tried[place] += way * step * scale[place]
                if (now := score(tried)) > value:
                    best, value, gained = tried, now, True
                    last[place] = way
                    report(place, value)
                    break
            else:
                last[place] = 0.0
        step *= 1.0 if gained else 0.5
        step *= 0.8
    return best, value


def _ways(last: float) -> tuple[float, ...]:
    """Return the directions to try: on in the one that gained before all others."""
    return (last, -last) if last else (1.0, -1.0)
