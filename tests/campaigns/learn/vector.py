"""The criteria of the likelihood as a vector of logarithms."""

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import HELD, Criteria
from pipelines.diagnosis.selection.prior import FEATURES


def names() -> list[str]:
    """Return what each place of the vector is."""
    return [f"{name}[{k}]" if several else name for name, k, several, _ in _places(Criteria())]


def to_vector(criteria: Criteria) -> NDArray:
    """Return the logarithm of each number."""
    return np.log([value for *_, value in _places(criteria)])


def from_vector(vector: NDArray, like: Criteria) -> Criteria:
    """Return criteria with a vector's numbers, the rest as in ``like``."""
    changed: dict[str, float | tuple[float, ...]] = {}
    for (name, k, several, _), value in zip(_places(like), np.exp(vector).tolist(), strict=True):
        if several:
            old = changed.get(name, getattr(like, name))
            changed[name] = (*old[:k], value, *old[k + 1 :])
        else:
            changed[name] = value
    return replace(like, **changed)


def _places(criteria: Criteria) -> list[tuple[str, int, bool, float]]:
    """Return name, number, whether there are several, and value."""
    places = []
    for field in fields(Criteria):
        value = getattr(criteria, field.name)
        if field.name in (*FEATURES, *HELD):
            continue
        several = isinstance(value, tuple)
        places += [
            (field.name, k, several, v) for k, v in enumerate(value if several else (value,))
        ]
    return places
