"""Criteria as a vector of numbers on scales where equal steps mean alike."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import Criteria


def names() -> list[str]:
    """Return what each place of the vector is."""
    found = []
    for field in fields(Criteria):
        value = getattr(Criteria(), field.name)
        if isinstance(value, tuple):
            found += [f"{field.name}[{k}]" for k in range(len(value)) if _free(field.name, k)]
        else:
            found.append(field.name)
    return found


def _free(name: str, k: int) -> bool:
    """Tell whether a place is learned: the first misfit is none at all."""
    return not (name == "misfits" and k == 0)


def to_vector(criteria: Criteria) -> NDArray:
    """Return logarithms of positive numbers, and log odds as they are."""
    return np.array([_scaled(value) for value in plain_values(criteria)])


def plain_values(criteria: Criteria) -> list[float]:
    found: list[float] = []
    for field in fields(Criteria):
        value = getattr(criteria, field.name)
        if isinstance(value, tuple):
            found += [v for k, v in enumerate(value) if _free(field.name, k)]
        else:
            found.append(value)
    return found


def _scaled(value: float) -> float:
    return float(np.log(value)) if value > 0.0 else value


def from_vector(vector: NDArray, like: Criteria) -> Criteria:
    """Return the criteria of a vector; ``like`` tells which are log odds."""
    at = iter(vector)
    changed = {}
    for field in fields(Criteria):
        value = getattr(like, field.name)
        if isinstance(value, tuple):
            changed[field.name] = tuple(_back(next(at), v) if _free(field.name, k) else v for k, v in enumerate(value))
        else:
            changed[field.name] = _back(next(at), value)
    return Criteria(**changed)


def _back(scaled: float, like: float) -> float:
    return float(np.exp(scaled)) if like > 0.0 else min(float(scaled), 0.0)
