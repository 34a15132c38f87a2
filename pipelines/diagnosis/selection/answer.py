"""Which causes are named, and what could stand in their place: read off the posterior."""

from collections.abc import Mapping
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

    def charged(self, ratios: Mapping[str, float], trained: Posterior) -> dict[str, float]:
        """Return what harm on the validation runs takes from log odds, by variant.

        Where a named cause does harm, so do its ties: these data cannot tell them apart. A value that each run has for
        itself is not charged, for one run says nothing of another's.

        Parameters
        ----------
        ratios : mapping of str to float
            Log likelihoods of the validation runs with a named cause over those without it, by label.
        trained : Posterior
            By the training runs.
        """
        found: dict[str, float] = {}
        for one in self.named:
            harm = min(ratios.get(one.element.label, 0.0), 0.0)
            alike = [e for e in trained.elements if e.label in one.members and not e.each_run]
            found |= {e.variant: harm for e in alike if harm < 0.0}
        return found

    def judged(self, charged: Mapping[str, float], trained: Posterior) -> "Answer":
        """Return the answer after validation: each named cause is judged by its own harm beside the others."""
        lowered = [_lowered(one, charged, trained) for one in self.named]
        kept = [one for one in lowered if one.probability >= CRITERIA.likely]
        weighed = trained.judged(charged)
        return Answer(tuple(sorted(kept, key=lambda one: -one.probability)), weighed.nothing, _unlisted(weighed))


def answer_of(posterior: Posterior) -> Answer:
    """Name the likely causes of the median probability set, each with its ties."""
    best = _best(posterior)
    found = [_named(posterior, best, i) for i in best if not posterior.elements[i].is_law]
    named = [one for one in found if one.probability >= CRITERIA.likely]
    return Answer(tuple(sorted(named, key=lambda one: -one.probability)), posterior.nothing, _unlisted(posterior))


def _unlisted(posterior: Posterior) -> float:
    pairs = zip(posterior.sets, posterior.probabilities, strict=True)
    return sum(float(p) for chosen, p in pairs if any(posterior.elements[i].is_law for i in chosen))


def _lowered(one: Named, charged: Mapping[str, float], trained: Posterior) -> Named:
    """Return a named cause after what it and its ties are charged.

    Where one value for all runs does harm, the same with a value for each run may take its place.
    """
    own = {e.variant for e in trained.elements if e.label in one.members} & charged.keys()
    if one.element.each_run or not own:
        return one
    judged = trained.judged({variant: charged[variant] for variant in own})
    has_one = ((chosen, i) for chosen in judged.sets for i in chosen if judged.elements[i].label in one.members)
    best, i = next(has_one)
    if judged.elements[i].each_run:
        return _named(judged, best, i)
    alone = judged.marginals[one.element.label]
    ties = tuple((label, p * alone / one.alone) for label, p in one.ties)
    return Named(one.element, judged.any_of(one.members), alone, ties)


def _best(posterior: Posterior) -> Set:
    """Return the most probable shapes of the most probable set of labels that has all that are likely.

    What most sets have in common may be likely where the most probable single set lacks it (Barbieri and Berger,
    2004, Annals of Statistics 32(3): the median probability model).
    """
    likely = {label for label, p in posterior.marginals.items() if p >= CRITERIA.likely}
    has_all = [labels for labels in posterior.by_labels if likely <= labels]
    labels = max(has_all or posterior.by_labels, key=lambda key: posterior.by_labels[key])
    return next(chosen for chosen in posterior.sets if posterior.labels_of(chosen) == labels)


def in_place(posterior: Posterior, label: str, others: frozenset[str]) -> tuple[float, dict[str, float]]:
    """Return how probable a cause is beside others, and each other listed cause in its place, the most probable first.

    Each set with the cause is compared with the sets that have another listed cause instead, all else alike.
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
    return Named(element, posterior.any_of(members), posterior.marginals[element.label], tuple(ties))
