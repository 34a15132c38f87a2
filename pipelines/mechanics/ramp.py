"""The way between rest and motion: a share of the motion that grows smoothly."""

import numpy as np
from numpy.typing import NDArray


def smooth_share(progress: NDArray) -> NDArray:
    """Return the quintic from 0 to 1 whose speed and acceleration vanish at both ends.

    Parameters
    ----------
    progress : (n,) array
        Time over the ramp's length; before 0 the share is 0, after 1 it is 1.
    """
    s = np.clip(progress, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))
