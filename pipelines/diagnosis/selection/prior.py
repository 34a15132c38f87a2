"""Define the prior over sets of elements: log odds that are linear in a set's features."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import Criteria
from pipelines.diagnosis.selection.evidence import Element

FEATURES = ("cause", "law", "further", "searched", "each_run", "worn", "coherence_weight")
"""Names of the criteria by which the features of a set are multiplied."""


def features(element: Element, auxiliary: Mapping[str, float]) -> NDArray:
    """Return the features (f,) of one element, in the order of ``FEATURES``, without units.

    Parameters
    ----------
    element : Element
    auxiliary : mapping of str to float
        Log likelihood of causes from evidence other than the mean torque, by label.
    """
    own = dict.fromkeys(FEATURES, 0.0)
    at_both = element.is_law and element.joint is None  # as improbable as a law at each joint
    own["law" if element.is_law else "cause"] = 1.0 + at_both
    own["further"] = float(at_both)
    own["searched"] = element.log_searched
    own["each_run"], own["worn"] = float(element.each_run), float(element.worn)
    own["coherence_weight"] = auxiliary.get(element.label, 0.0)
    return np.array(list(own.values()))


def of_set(chosen: Sequence[NDArray]) -> NDArray:
    """Return the features of a set.

    Parameters
    ----------
    chosen : sequence of (f,) arrays
        Features of its elements.

    Returns
    -------
    (f,) array
        Their sum, and the number of further elements.
    """
    total = np.sum(chosen, axis=0) if len(chosen) else np.zeros(len(FEATURES))
    total[FEATURES.index("further")] += max(len(chosen) - 1, 0)
    return total


def weights(criteria: Criteria) -> NDArray:
    """Return the log odds of one unit of each feature.

    The base rate counts once in a set that is not empty.

    Parameters
    ----------
    criteria : Criteria
        Log odds by name.

    Returns
    -------
    (f,) array
        In the order of ``FEATURES``.
    """
    by_name = {name: getattr(criteria, name) for name in FEATURES}
    # n elements add n base rates, and n - 1 further ones subtract all but one.
    by_name["cause"] += criteria.base_rate
    by_name["law"] += criteria.base_rate
    by_name["further"] -= criteria.base_rate
    return np.array(list(by_name.values()))
