"""Compute the posterior over sets of causes and laws.

Every element is weighed alone. Pairs of their two best shapes are screened, and the best weighed in
full; triples extend the best pairs. Marginals are reported: of nothing missing, of each cause, of
something unlisted, of each family at each joint.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import logit, logsumexp

from pipelines.diagnosis.candidates.library import Context
from pipelines.diagnosis.candidates.smooth_laws import TIME
from pipelines.diagnosis.criteria import CRITERIA, Criteria
from pipelines.diagnosis.selection.evidence import Element, Evidence
from pipelines.diagnosis.selection.marginal_likelihood import MarginalLikelihood

SURE = 1.0 - 1e-12
"""Probability that counts as certain: above it rounding decides."""

Set = tuple[int, ...]


@dataclass(frozen=True)
class Posterior:
    """Probabilities of sets of elements."""

    elements: tuple[Element, ...]
    sets: tuple[Set, ...]
    """By falling probability."""
    log_odds: NDArray
    """(sets,) against the empty set."""

    @cached_property
    def probabilities(self) -> NDArray:
        """Probability of each set, (sets,); they add up to one."""
        p = np.exp(self.log_odds - self.log_odds.max())  # the empty set is always finite
        return np.asarray(p / p.sum())

    def judged(self, charged: Mapping[str, float]) -> "Posterior":
        """Return the posterior after validation: a cause that harms there is less probable.

        A cause that helps there gains nothing: the searched runs have counted the part that it
        explains.

        Parameters
        ----------
        charged : mapping of str to float
            Log odds that the validation runs subtract, zero or negative, by variant of a cause.
        """
        if not charged:
            return self
        variants = [{self.elements[i].variant for i in chosen} for chosen in self.sets]
        harm = [sum(charged[variant] for variant in own & charged.keys()) for own in variants]
        return self._with(self.log_odds + np.array(harm))

    def at_least(self, labels: frozenset[str], probability: float) -> "Posterior":
        """Return the posterior where some label of a group has at least a given probability.

        Ratios among the sets with such a label, and among those without, are kept (Jeffrey, 1965,
        The Logic of Decision, chapter 11).

        Parameters
        ----------
        labels : frozenset of str
            The group.
        probability : float
            0 to 1.
        """
        inside = np.array([not labels.isdisjoint(self.labels_of(chosen)) for chosen in self.sets])
        if not inside.any():
            return self
        # The empty set has no label, so the sets outside are never without probability.
        wanted = float(logit(min(probability, SURE)))
        lacking = wanted - float(
            logsumexp(self.log_odds[inside]) - logsumexp(self.log_odds[~inside])
        )
        # Log odds by which a probability may fall short of its least value.
        tolerance = 1e-6
        if not tolerance < lacking < np.inf:
            return self
        return self._with(self.log_odds + np.where(inside, lacking, 0.0))

    def _with(self, log_odds: NDArray) -> "Posterior":
        """Return the posterior with other log odds of the sets, (sets,)."""
        order = np.argsort(-log_odds, kind="stable")
        return Posterior(self.elements, tuple(self.sets[k] for k in order), log_odds[order])

    def labels_of(self, chosen: Set) -> frozenset[str]:
        """Return the labels of a set's elements."""
        return frozenset(self.elements[i].label for i in chosen)

    def any_of(self, labels: frozenset[str]) -> float:
        """Return the probability that at least one of some labels is in the true set."""
        return min(sum(p for own, p in self.by_labels.items() if own & labels), 1.0)

    @cached_property
    def by_labels(self) -> dict[frozenset[str], float]:
        """Probability of each set of labels, summed over shapes."""
        totals: dict[frozenset[str], float] = {}
        for chosen, p in zip(self.sets, self.probabilities, strict=True):
            labels = self.labels_of(chosen)
            totals[labels] = totals.get(labels, 0.0) + float(p)
        return totals

    @cached_property
    def unweighed(self) -> frozenset[frozenset[str]]:
        """Sets of labels whose log odds are infinite because rounding made matrices indefinite."""
        pairs = zip(self.sets, self.log_odds, strict=True)
        weighed = {self.labels_of(chosen) for chosen, odds in pairs if np.isfinite(odds)}
        return frozenset(self.by_labels.keys() - weighed)

    @property
    def nothing(self) -> float:
        """Probability that nothing is missing."""
        return self.by_labels.get(frozenset(), 0.0)

    @cached_property
    def marginals(self) -> dict[str, float]:
        """Probability that each label is in the true set, the most probable first."""
        totals: dict[str, float] = {}
        for labels, p in self.by_labels.items():
            for label in labels:
                totals[label] = totals.get(label, 0.0) + p
        # Rounding may make a sum of probabilities slightly larger than one.
        return {
            label: min(p, 1.0) for label, p in sorted(totals.items(), key=lambda item: -item[1])
        }


def posterior(evidence: Evidence, criteria: Criteria = CRITERIA) -> Posterior:
    """Weigh sets of up to three elements, each with bursts at a joint as well.

    Parameters
    ----------
    evidence : Evidence
        Products of the library's columns.
    criteria : Criteria, optional
        Prior odds and amplitudes.
    """
    weigh = MarginalLikelihood(evidence, criteria)
    odds: dict[Set, float] = {(): 0.0}
    # A shape refined in a set counts in that set only: otherwise the cause would count twice.
    odds |= {(i,): float(weigh.alone[i]) for i, e in enumerate(evidence.elements) if _explains(e)}
    for chosen in (*_pairs(weigh), *(tuple(sorted(own)) for own in evidence.contexts)):
        odds[chosen] = weigh(chosen)
    for chosen in _triples(weigh, odds):
        odds[chosen] = weigh(chosen)
    # If one cause of the best set is refuted, the others remain.
    best = max(odds, key=lambda chosen: odds[chosen])
    odds |= {chosen: weigh(chosen) for chosen in combinations(best, 2) if chosen not in odds}
    odds |= dict(_with_bursts(weigh, odds))
    sets = sorted(odds, key=lambda chosen: -odds[chosen])
    return Posterior(evidence.elements, tuple(sets), np.array([odds[chosen] for chosen in sets]))


def _explains(element: Element) -> bool:
    """Return whether an element explains rows in any set, and not only in its own."""
    return element.refined_in < 0 and bool(element.columns)


def _with_bursts(
    weigh: MarginalLikelihood, odds: Mapping[Set, float]
) -> Iterator[tuple[Set, float]]:
    """Yield each set with bursts at a joint: they explain no rows, so their evidence multiplies."""
    elements = weigh.evidence.elements
    for i in (i for i, element in enumerate(elements) if not element.columns):
        own = float(weigh.apart[i])
        for chosen, value in odds.items():
            together = (*chosen, i)
            yield together, value + own + weigh.prior(together) - weigh.prior(chosen)


def likely_contexts(weighed: Posterior) -> list[Context]:
    """Return sets of several elements to refine together.

    The sets are more probable than nothing, unless it is likely that something is missing.
    """
    contexts: dict[frozenset[str], Context] = {}
    # Most sets whose causes are refined together.
    most = 8
    for chosen in weighed.sets:
        # A law without columns leaves a cause's shape as it is.
        elements = [e for e in (weighed.elements[i] for i in chosen) if e.columns]
        causes = tuple(e.library_number for e in elements if not e.is_law)
        if len(elements) > 1 and causes:
            laws = tuple(e.variant for e in elements if e.is_law)
            contexts.setdefault(frozenset(e.variant for e in elements), Context(causes, laws))
        # Sets come by falling probability: all after the empty one are less likely than nothing.
        if len(contexts) == most or (not chosen and weighed.nothing > CRITERIA.named_from):
            break
    return list(contexts.values())


def strongest(weighed: Posterior) -> list[int]:
    """Return the library's numbers of the causes that alone explain most.

    The result is empty where nothing is missing.
    """
    causes: dict[str, int] = {}
    # Number of most probable single causes, each of which is refined together with possible
    # partners.
    most = 2
    for chosen in weighed.sets:
        element = weighed.elements[chosen[0]] if len(chosen) == 1 else None
        if len(causes) == most or (not chosen and weighed.nothing > CRITERIA.named_from):
            break
        if element is not None and not element.is_law:
            causes.setdefault(element.label, element.library_number)
    return list(causes.values())


def _contenders(weigh: MarginalLikelihood) -> tuple[list[int], list[int], list[int]]:
    """Return the best shapes of each element, its best one, and the laws of wandering torque."""
    elements = weigh.evidence.elements
    shapes: dict[str, list[int]] = {}
    for i in np.argsort(-weigh.alone):
        if _explains(elements[i]):
            shapes.setdefault(elements[i].variant, []).append(int(i))
    # Screening sees few columns of an element, and a wandering torque has dozens. So it is paired
    # with the best elements instead.
    wide = [i for i, e in enumerate(elements) if e.is_law and e.name == TIME]
    # Number of shapes of each cause in pairs.
    of_each = 2
    several = [i for own in shapes.values() for i in own[:of_each] if i not in wide]
    return several, [own[0] for own in shapes.values()], wide


def _pairs(weigh: MarginalLikelihood) -> list[Set]:
    """Return the pairs to weigh in full."""
    several, best, wide = _contenders(weigh)
    pairs, odds = weigh.pairs(several)
    # Number of pairs that are weighed in full.
    most = 150
    order = np.argsort(-odds)[:most]
    chosen = {tuple(sorted(map(int, pairs[n]))) for n in order}
    # Number of elements that are paired with a wandering torque.
    partners = 15
    chosen |= {tuple(sorted((w, i))) for w in wide for i in best[:partners] if i != w}
    return sorted(chosen)


def _triples(weigh: MarginalLikelihood, odds: dict[Set, float]) -> list[Set]:
    """Return the triples to weigh in full: they extend the best pairs."""
    elements = weigh.evidence.elements
    _, best, wide = _contenders(weigh)
    # Number of pairs that are extended to triples.
    extended = 6
    pairs = sorted((s for s in odds if len(s) == 2), key=lambda s: -odds[s])[:extended]
    triples: set[Set] = set()
    # Number of triples of each pair that are weighed in full.
    of_each_pair = 8
    for pair in pairs:
        labels = {elements[i].label for i in pair}
        more = [i for i in {*best, *wide} if elements[i].label not in labels]
        scored = sorted(more, key=lambda i: -weigh.rough((*pair, i)))
        triples |= {tuple(sorted((*pair, i))) for i in scored[:of_each_pair]}
    return sorted(triples)
