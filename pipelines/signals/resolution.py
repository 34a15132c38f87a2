"""The smallest step of a channel's values."""

import numpy as np
from numpy.typing import NDArray


def smallest_step(values: NDArray) -> float:
    """Return the smallest difference between two values (n,); infinite where all are equal.

    Differences by rounding in float64 are no steps.
    """
    steps = np.diff(np.unique(values))
    return float(steps[steps > 1e-9 * np.abs(values).max(initial=0.0)].min(initial=np.inf))
