"""How probable it is that a named cause is an unlisted effect that only resembles it.

No catalogue is complete. The posterior explains an effect that nobody listed by whichever listed cause resembles it
most, and is as sure of it as of a true cause. The validation runs tell them apart: a true cause removes nearly all of
the systematic error that the model leaves without it there, a mere resemblance a part.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import expit

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.evidence import Element
from pipelines.diagnosis.selection.posterior import Posterior

IN_WORDS = {
    "unlisted_angle": "another law of {joint}'s angle",
    "unlisted_speed": "another law of {joint}'s speed",
    "unlisted_reversal": "other friction of {joint} that remembers its reversals",
    "unlisted_load": "another law of {joint}'s load",
    "unlisted_time": "another torque at {joint} that changes with time",
    "unlisted_transmission": "something else in {joint}'s transmission",
    "unlisted_sensor": "something else in {joint}'s sensors",
    "unlisted_person": "something else of the person at {joint}",
}
"""The law that a look-alike is taken for, by its kind: a cause's family is hardly ever mistaken."""
LEAST = 0.01
"""Smallest share of the systematic error whose logarithm is taken."""
TINY = 1e-12
"""Smallest probability that another is divided by."""


def listed_share(removed: ArrayLike, instead: ArrayLike = 0.0, look_alike: ArrayLike = CRITERIA.look_alike) -> NDArray:
    """Return the share of its probability that a named cause keeps, (...): that it is no look-alike.

    Parameters
    ----------
    removed : ArrayLike
        (...) share of the systematic error of the validation runs that it removes, 0 to 1.
    instead : ArrayLike
        (...) probability of smooth laws of its family and joint in its place, over its own. An unlisted effect has that
        already.
    look_alike : ArrayLike
        (2,) the criterion.
    """
    certain, slope = np.asarray(look_alike)
    resembles = expit(-certain - slope * np.log(np.maximum(removed, LEAST)))
    return np.asarray(1.0 - np.maximum(resembles - np.asarray(instead), 0.0))


def with_look_alikes(posterior: Posterior, removed: Mapping[frozenset[str], float]) -> Posterior:
    """Return the posterior in which each named cause may be an unlisted effect of its family and joint.

    Every set with the cause gives a share of its probability to the same set with an unlisted law in its place. What
    smooth laws of that family and joint have in its place already is no part of that share.

    Parameters
    ----------
    posterior : Posterior
        Of listed causes and smooth laws.
    removed : mapping of frozenset to float
        Share of the systematic error that a cause removes, by its label and those of its ties.
    """
    listed: dict[str, float] = {}
    for labels, share in removed.items():
        listed |= dict.fromkeys(labels, float(listed_share(share, _unlisted_instead(posterior, labels))))
    elements = list(posterior.elements)
    instead: dict[int, int] = {}
    for i, element in enumerate(posterior.elements):
        if element.label in listed:
            instead[i] = len(elements)
            elements.append(_unlisted(element))
    sets, log_odds = [], []
    for chosen, odds in zip(posterior.sets, posterior.log_odds, strict=True):
        for other, weight in _split(chosen, instead, [listed.get(elements[i].label, 1.0) for i in chosen]):
            if weight > 0.0:
                sets.append(other)
                log_odds.append(odds + np.log(weight))
    order = np.argsort(-np.array(log_odds), kind="stable")
    return Posterior(tuple(elements), tuple(sets[k] for k in order), np.array(log_odds)[order])


def _unlisted_instead(posterior: Posterior, labels: frozenset[str]) -> float:
    """Return the probability of smooth laws in the place of tied causes, of their family and joint, over their own."""
    places = {(e.family, e.joint) for e in posterior.elements if e.label in labels}
    laws = {e.label for e in posterior.elements if e.is_law and (e.family, e.joint) in places}
    instead = sum(p for own, p in posterior.by_labels.items() if own & laws and not own & labels)
    return instead / max(posterior.any_of(labels), TINY)


def _split(
    chosen: Sequence[int], instead: Mapping[int, int], listed: Sequence[float]
) -> list[tuple[tuple[int, ...], float]]:
    """Return a set with each choice of its look-alikes, and the share of its probability that each has."""
    ways = [
        [(i, p), (instead[i], 1.0 - p)] if i in instead else [(i, 1.0)]
        for i, p in zip(chosen, listed, strict=True)
    ]  # fmt: skip
    return [(tuple(i for i, _ in way), float(np.prod([p for _, p in way]))) for way in product(*ways)]


def _unlisted(element: Element) -> Element:
    """Return the unlisted law that a cause is a look-alike of."""
    kind = f"unlisted_{element.family}"
    at = f"@{element.joint}" if element.joint else ""
    return replace(element, label=f"law:{kind}{at}", name=kind, is_law=True, each_run=False, worn=False)
