"""Estimate the probability that a named cause is an unlisted effect that resembles it.

No catalogue is complete. The posterior explains an unlisted effect by the listed cause that
resembles it most, and is as sure of it as of a true cause. The validation runs separate them: a
true cause removes nearly all of the systematic error that remains without it there, a mere
resemblance only a part.
"""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import expit

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.evidence import Element
from pipelines.diagnosis.selection.posterior import Posterior
from pipelines.wording.law import UNLISTED, law_label


def kept_share(
    removed: ArrayLike,
    smooth_law_ratio: ArrayLike = 0.0,
    look_alike: ArrayLike = CRITERIA.look_alike,
) -> NDArray:
    """Return the share of its probability that a named cause keeps, (...), as no look-alike.

    Parameters
    ----------
    removed : (...) array
        Share of the systematic error of the validation runs that it removes, 0 to 1.
    smooth_law_ratio : (...) array
        Probability of smooth laws of its family and joint in its place, over its own. An unlisted
        effect has that already.
    look_alike : (2,) array
        The criterion.

    Returns
    -------
    (...) array
        Between 0 and 1.
    """
    intercept, slope = np.asarray(look_alike)
    # Smallest share of the systematic error whose logarithm is taken.
    least = 0.01
    # One less the chance of a true cause, whose log odds are a + b ln r.
    resembles = expit(-intercept - slope * np.log(np.maximum(removed, least)))
    return np.asarray(1.0 - np.maximum(resembles - np.asarray(smooth_law_ratio), 0.0))


def with_look_alikes(posterior: Posterior, removed: Mapping[frozenset[str], float]) -> Posterior:
    """Return the posterior in which each named cause may be an unlisted similar effect.

    Such an effect has its family and joint. Every set with the cause gives a share of its
    probability to the same set with an unlisted law in its place. The probability that smooth laws
    of that family and joint have in its place already is subtracted.

    Parameters
    ----------
    posterior : Posterior
        Of listed causes and smooth laws.
    removed : mapping of frozenset to float
        Share of the systematic error that a cause removes, by its label and those of its ties.
    """
    kept: dict[str, float] = {}
    for labels, share in removed.items():
        # The data do not separate ties from the cause, so they lose the same share.
        kept |= dict.fromkeys(
            labels, float(kept_share(share, _smooth_law_ratio(posterior, labels)))
        )
    elements = list(posterior.elements)
    law_of: dict[int, int] = {}
    for i, element in enumerate(posterior.elements):
        if element.label in kept:
            law_of[i] = len(elements)
            elements.append(_unlisted(element))
    sets, log_odds = [], []
    for chosen, odds in zip(posterior.sets, posterior.log_odds, strict=True):
        for other, weight in _split(
            chosen, law_of, [kept.get(elements[i].label, 1.0) for i in chosen]
        ):
            if weight > 0.0:
                sets.append(other)
                log_odds.append(odds + np.log(weight))
    order = np.argsort(-np.array(log_odds), kind="stable")
    return Posterior(tuple(elements), tuple(sets[k] for k in order), np.array(log_odds)[order])


def _smooth_law_ratio(posterior: Posterior, labels: frozenset[str]) -> float:
    """Return the probability of smooth laws in the place of tied causes, over their own.

    The laws are of the causes' families and joints.
    """
    places = {(e.family, e.joint) for e in posterior.elements if e.label in labels}
    laws = {e.label for e in posterior.elements if e.is_law and (e.family, e.joint) in places}
    probability = sum(
        p for own, p in posterior.by_labels.items() if own & laws and not own & labels
    )
    return probability / posterior.any_of(labels)


def _split(
    chosen: Sequence[int], law_of: Mapping[int, int], kept: Sequence[float]
) -> list[tuple[tuple[int, ...], float]]:
    """Return each way to replace causes of a set by unlisted laws, with its probability share."""
    ways = [
        [(i, p), (law_of[i], 1.0 - p)] if i in law_of else [(i, 1.0)]
        for i, p in zip(chosen, kept, strict=True)
    ]
    return [
        (tuple(i for i, _ in way), float(np.prod([p for _, p in way]))) for way in product(*ways)
    ]


def _unlisted(cause: Element) -> Element:
    """Return the unlisted law of a cause's family and joint."""
    kind = UNLISTED + cause.family
    return Element(
        law_label(kind, cause.joint),
        kind,
        cause.joint,
        cause.family,
        is_law=True,
        columns=[],
        variance=[],
        repeats=cause.repeats,
    )
