"""Name the parameters that a motion does not separate.

Source: Belsley, Kuh and Welsch (1980), Regression Diagnostics, ch. 3.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def profiled(gram: NDArray, others: NDArray) -> NDArray:
    """Return the information on some parameters if the others are unknown as well.

    It is the Schur complement of the others' block in A'A.

    Parameters
    ----------
    gram : (p, p) array
        A'A.
    others : (k,) int array
        Indices of the other parameters.

    Returns
    -------
    (p - k, p - k) array
    """
    kept = np.setdiff1d(np.arange(len(gram)), others)
    # The other parameters may be collinear among themselves, hence the pseudoinverse.
    across = gram[np.ix_(kept, others)]
    return np.asarray(
        gram[np.ix_(kept, kept)] - across @ np.linalg.pinv(gram[np.ix_(others, others)]) @ across.T
    )


def collinearities(gram: NDArray, names: Sequence[str]) -> list[str]:
    """Describe the groups of parameters that the data hardly separate; empty if there are none.

    Parameters
    ----------
    gram : (p, p) array
        Weighted A'A.
    names : sequence of str
        Names of the p parameters.
    """
    # Condition indices at which Belsley calls a dependence weak, and strong.
    weak, strong = 10.0, 30.0
    # Share of a parameter's variance above which a dependence involves it.
    involves = 0.5
    # Columns of unit norm, because parameters have different units.
    size = np.sqrt(np.diag(gram))
    eigenvalues, vectors = np.linalg.eigh(gram / np.outer(size, size))
    # Rounding can make the least eigenvalue negative, which has no condition index.
    eigenvalues = np.maximum(eigenvalues, np.finfo(float).tiny)
    index = np.sqrt(eigenvalues[-1] / eigenvalues)
    # Parameter i has this part of its variance from direction k, in units of the noise.
    variance = vectors**2 / eigenvalues
    shares = variance / variance.sum(axis=1, keepdims=True)
    sentences = []
    for k in np.flatnonzero(index > weak):
        of_k = zip(names, shares[:, k], strict=True)
        involved = [name for name, share in of_k if share > involves]
        # A dependence harms only where it involves two parameters or more (Belsley's rule).
        if len(involved) > 1:
            how = "hardly separates" if index[k] > strong else "separates only weakly"
            listed = f"{', '.join(involved[:-1])} and {involved[-1]}"
            sentences.append(
                f"this motion {how} {listed} (condition index {index[k]:.0f}): "
                "the others compensate for an error in one"
            )
    return sentences
