"""Which parameters a motion cannot tell apart, in words (Belsley, Kuh and Welsch, 1980, ch. 3)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

WEAK = 10.0
STRONG = 30.0
"""Condition indices at which Belsley calls a dependence weak, and strong."""
SHARE = 0.5
"""Of a parameter's variance that a dependence must hold to involve it."""


def scaled_gram(gram: NDArray) -> NDArray:
    """Return A'A, (p, p), with the columns of A scaled to unit norm."""
    size = np.sqrt(np.diag(gram))
    return gram / np.outer(size, size)


def profiled(gram: NDArray, others: NDArray) -> NDArray:
    """Return what A'A, (p, p), tells of some parameters where the ``others``, indices (k,), are
    unknown as well.

    It is the Schur complement of the others' block, (p - k, p - k).
    """
    kept = np.setdiff1d(np.arange(len(gram)), others)
    across = gram[np.ix_(kept, others)]
    return np.asarray(
        gram[np.ix_(kept, kept)] - across @ np.linalg.pinv(gram[np.ix_(others, others)]) @ across.T
    )


def collinearities(gram: NDArray, names: Sequence[str]) -> list[str]:
    """Say which groups of parameters the data hardly separate; empty when all are well apart.

    ``gram`` is the weighted A'A, (p, p).
    """
    eigenvalues, vectors = np.linalg.eigh(scaled_gram(gram))
    eigenvalues = np.maximum(eigenvalues, np.finfo(float).tiny)
    index = np.sqrt(eigenvalues[-1] / eigenvalues)
    variance = vectors**2 / eigenvalues
    shares = variance / variance.sum(axis=1, keepdims=True)
    sentences = []
    for k in np.flatnonzero(index > WEAK):
        involved = [name for name, share in zip(names, shares[:, k], strict=True) if share > SHARE]
        if len(involved) > 1:
            how = "hardly separates" if index[k] > STRONG else "separates only weakly"
            sentences.append(
                f"this motion {how} {_listed(involved)} (condition index {index[k]:.0f}): "
                "an error in one is made up by the others"
            )
    return sentences


def worst_direction(scaled: NDArray, names: Sequence[str]) -> list[str]:
    """Return the parameters that the least determined combination of a scaled A'A, (p, p),
    mixes."""
    _, vectors = np.linalg.eigh(scaled)
    weight = np.abs(vectors[:, 0])
    return [names[i] for i in np.argsort(-weight) if weight[i] > 0.3 * weight.max()]


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
