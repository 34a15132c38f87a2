"""Read off the posterior which causes are named, and which could replace them."""

from collections.abc import Sequence
from dataclasses import dataclass

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.evidence import Element
from pipelines.diagnosis.selection.posterior import Posterior, Set


@dataclass(frozen=True)
class NamedCause:
    """A named cause."""

    element: Element
    """At its most probable shape."""
    probability: float
    """Of it or of one of its ties."""
    alone: float
    """Of it without its ties."""
    ties: tuple[tuple[str, float], ...]
    """Labels that the recordings cannot separate from it, with their probabilities."""

    @property
    def members(self) -> frozenset[str]:
        """Its label and those of its ties."""
        return frozenset((self.element.label, *(label for label, _ in self.ties)))


@dataclass(frozen=True)
class Answer:
    """The answer of the posterior: named causes, and two probabilities."""

    named: tuple[NamedCause, ...]
    """The most probable first."""
    nothing: float
    """Probability that nothing is missing."""
    unlisted: float
    """Probability that an unlisted law is missing."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the named causes, the most probable first."""
        return tuple(one.element.label for one in self.named)

    @property
    def variants(self) -> frozenset[str]:
        """Variants of the named causes."""
        return frozenset(one.element.variant for one in self.named)

    @property
    def members(self) -> frozenset[str]:
        """Labels of all named causes and of their ties."""
        return frozenset(label for one in self.named for label in one.members)


def answer_of(posterior: Posterior, together: Sequence[frozenset[str]] = ()) -> Answer:
    """Name the likely causes of the median probability set, each with its ties.

    Parameters
    ----------
    posterior : Posterior
    together : sequence of frozenset of str
        Groups of labels that were named as ties before. One of a likely group is named, though none
        of it may be as probable as nothing.

    Returns
    -------
    Answer
    """
    best = _best(posterior)
    candidates = [_named(posterior, best, i) for i in best if not posterior.elements[i].is_law]
    for group in together:
        if posterior.any_of(group) >= CRITERIA.named_from and not any(
            group & one.members for one in candidates
        ):
            members = (
                (chosen, i)
                for chosen in posterior.sets
                for i in chosen
                if posterior.elements[i].label in group
            )
            candidates.append(_named(posterior, *next(members)))
    named = [one for one in candidates if one.probability >= CRITERIA.named_from]
    return Answer(
        tuple(sorted(named, key=lambda one: -one.probability)),
        posterior.nothing,
        _unlisted(posterior),
    )


def _unlisted(posterior: Posterior) -> float:
    pairs = zip(posterior.sets, posterior.probabilities, strict=True)
    return sum(float(p) for chosen, p in pairs if any(posterior.elements[i].is_law for i in chosen))


def _best(posterior: Posterior) -> Set:
    """Return the most probable shapes of the most probable set that has all likely labels.

    The common part of most sets may be likely where the most probable single set lacks it (Barbieri
    and Berger, 2004, Annals of Statistics 32(3): the median probability model).
    """
    likely, sets = frozenset[str](), list(posterior.by_labels)
    # Two labels may be likely each by itself, and hardly ever occur in one set: each explains the
    # other, as inseparable causes do.
    for label, _ in sorted(posterior.marginals.items(), key=lambda pair: -pair[1]):
        with_it = [own for own in sets if label in own]
        if sum(posterior.by_labels[own] for own in with_it) >= CRITERIA.named_from:
            likely, sets = likely | {label}, with_it
    # Rivals share the probability that there is one more cause, and each may have less than none.
    listed = {e.label for e in posterior.elements if not e.is_law}
    with_more = [own for own in sets if (own - likely) & listed]
    if sum(posterior.by_labels[own] for own in with_more) >= CRITERIA.named_from:
        sets = with_more
    labels = max(sets, key=lambda own: posterior.by_labels[own])
    return next(chosen for chosen in posterior.sets if posterior.labels_of(chosen) == labels)


def in_place(
    posterior: Posterior, label: str, others: frozenset[str]
) -> tuple[float, dict[str, float]]:
    """Return the probability of a cause with others, and of each listed cause in its place.

    Each set with the cause is compared with the sets that have another listed cause instead, all
    else equal.

    Parameters
    ----------
    posterior : Posterior
        Probabilities of sets.
    label : str
        The cause.
    others : frozenset of str
        Causes that a set must have as well.

    Returns
    -------
    tuple
        Probability, and by label those of rivals, the most probable first.
    """
    listed = {e.label for e in posterior.elements if not e.is_law}
    own, rivals = 0.0, dict.fromkeys(sorted(listed - others - {label}), 0.0)
    for labels, p in posterior.by_labels.items():
        if label in labels and others <= labels:
            own += p
            for rival in rivals.keys() - labels:
                rivals[rival] += posterior.by_labels.get(labels - {label} | {rival}, 0.0)
    return own, dict(sorted(rivals.items(), key=lambda item: -item[1]))


def _named(posterior: Posterior, best: Set, i: int) -> NamedCause:
    """Return a cause of the best set with its ties: listed causes that could replace it."""
    element = posterior.elements[i]
    rest = posterior.labels_of(best) - {element.label}
    own, rivals = in_place(posterior, element.label, rest)
    ties = [(label, p) for label, p in rivals.items() if p >= CRITERIA.tied_from * own]
    members = frozenset((element.label, *(label for label, _ in ties)))
    return NamedCause(
        element, posterior.any_of(members), posterior.marginals[element.label], tuple(ties)
    )
