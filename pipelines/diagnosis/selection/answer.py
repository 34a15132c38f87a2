"""Which causes are named, and what could stand in their place: read off the posterior."""

from collections.abc import Sequence
from dataclasses import dataclass

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.selection.evidence import Element
from pipelines.diagnosis.selection.posterior import Posterior, Set


@dataclass(frozen=True)
class Named:
    """A named cause."""

    element: Element
    """At its most probable shape."""
    probability: float
    """Of it or of one of its ties."""
    alone: float
    """Of it without its ties."""
    ties: tuple[tuple[str, float], ...]
    """Labels that cannot be told from it, with their probabilities."""

    @property
    def members(self) -> frozenset[str]:
        """Its label and those of its ties."""
        return frozenset((self.element.label, *(label for label, _ in self.ties)))


@dataclass(frozen=True)
class Answer:
    """What the posterior says."""

    named: tuple[Named, ...]
    """The most probable first."""
    nothing: float
    """Probability that nothing is missing."""
    unlisted: float
    """Probability that an unlisted law is missing."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of all that is named, the most probable first."""
        return tuple(one.element.label for one in self.named)

    @property
    def variants(self) -> frozenset[str]:
        """Variants of all that is named."""
        return frozenset(one.element.variant for one in self.named)

    @property
    def members(self) -> frozenset[str]:
        """Labels of all that is named, and of the ties."""
        return frozenset(label for one in self.named for label in one.members)


def answer_of(posterior: Posterior, together: Sequence[frozenset[str]] = ()) -> Answer:
    """Name the likely causes of the median probability set, each with its ties.

    ``together`` are groups of labels that were named as ties before: one of such a group is named
    where the group is likely, though none of it may be as probable as nothing.
    """
    best = _best(posterior)
    candidates = [_named(posterior, best, i) for i in best if not posterior.elements[i].is_law]
    for group in together:
        if posterior.any_of(group) >= CRITERIA.likely and not any(
            group & one.members for one in candidates
        ):
            members = (
                (chosen, i)
                for chosen in posterior.sets
                for i in chosen
                if posterior.elements[i].label in group
            )
            candidates.append(_named(posterior, *next(members)))
    named = [one for one in candidates if one.probability >= CRITERIA.likely]
    return Answer(
        tuple(sorted(named, key=lambda one: -one.probability)),
        posterior.nothing,
        _unlisted(posterior),
    )


def _unlisted(posterior: Posterior) -> float:
    pairs = zip(posterior.sets, posterior.probabilities, strict=True)
    return sum(float(p) for chosen, p in pairs if any(posterior.elements[i].is_law for i in chosen))


def _best(posterior: Posterior) -> Set:
    """Return the most probable shapes of the most probable set of labels that has all that are
    likely.

    What most sets have in common may be likely where the most probable single set lacks it
    (Barbieri and Berger, 2004, Annals of Statistics 32(3): the median probability model).
    """
    likely = {label for label, p in posterior.marginals.items() if p >= CRITERIA.likely}
    has_all = [labels for labels in posterior.by_labels if likely <= labels]
    labels = max(has_all or posterior.by_labels, key=lambda key: posterior.by_labels[key])
    return next(chosen for chosen in posterior.sets if posterior.labels_of(chosen) == labels)


def in_place(
    posterior: Posterior, label: str, others: frozenset[str]
) -> tuple[float, dict[str, float]]:
    """Return how probable a cause is beside others, and each other listed cause in its place, the
    most probable first.

    Each set with the cause is compared with the sets that have another listed cause instead, all
    else alike.
    """
    listed = {e.label for e in posterior.elements if not e.is_law}
    own, rivals = 0.0, dict.fromkeys(sorted(listed - others - {label}), 0.0)
    for labels, p in posterior.by_labels.items():
        if label in labels and others <= labels:
            own += p
            for rival in rivals.keys() - labels:
                rivals[rival] += posterior.by_labels.get(labels - {label} | {rival}, 0.0)
    return own, dict(sorted(rivals.items(), key=lambda item: -item[1]))


def _named(posterior: Posterior, best: Set, i: int) -> Named:
    """Return a cause of the best set with its ties: listed causes that could replace it."""
    element = posterior.elements[i]
    rest = posterior.labels_of(best) - {element.label}
    own, rivals = in_place(posterior, element.label, rest)
    ties = [(label, p) for label, p in rivals.items() if p >= CRITERIA.tied * own]
    members = frozenset((element.label, *(label for label, _ in ties)))
    return Named(
        element, posterior.any_of(members), posterior.marginals[element.label], tuple(ties)
    )
