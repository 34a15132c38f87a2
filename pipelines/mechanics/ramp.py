"""The transition between rest and motion: a share of the motion that grows smoothly."""

import numpy as np
from numpy.typing import NDArray


def smooth_share(progress: NDArray) -> NDArray:
    """Return the quintic from 0 to 1 whose first two derivatives vanish at both ends.

    Parameters
    ----------
    progress : (n,) array
        Time over the ramp's length; the share is 0 before 0, and 1 after 1.

    Returns
    -------
    (n,) array
    """
    s = np.clip(progress, 0.0, 1.0)
    # Both derivatives are zero at the ends, so that the scaled motion has no jump of acceleration.
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))
