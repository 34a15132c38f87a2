"""The sandwich covariance of estimated values (White, 1982, Econometrica 50(1))."""

import numpy as np
from numpy.typing import NDArray


def sandwich(sensitivity: NDArray, filling: NDArray) -> NDArray:
    """Return sensitivity x filling x sensitivityᵀ, symmetric and without negative variances.

    Parameters
    ----------
    sensitivity : (k, p) array
        Slopes of the values by the sums of scores, or by other values.
    filling : (p, p) array
        Covariance of these.

    Returns
    -------
    (k, k) array
    """
    # Where the values are hardly separated, large numbers cancel in the product, and rounding
    # errors would make it asymmetric. The square of a root has no such errors.
    values, vectors = np.linalg.eigh(filling)
    root = sensitivity @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    return np.asarray(root @ root.T)
