"""Which set of causes is named, how likely each is, and what cannot be told from it."""

import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.bank import Bank
from pipelines.diagnosis.candidates import Candidate
from pipelines.diagnosis.fit import Fit, fit, refined, residuals_on
from pipelines.diagnosis.floor import MOST_INDEPENDENT, Floor, independent_share
from pipelines.diagnosis.freer_form import AS_RIVAL, FreerForm, freeable, in_form
from pipelines.diagnosis.perceived import heard_in
from pipelines.diagnosis.rhythm import shadows_motion
from pipelines.diagnosis.search import Scored, Scorer, cost, known_besides, log_likelihood, search
from pipelines.effects import Effect
from pipelines.label import effect_labelled
from pipelines.model import effect_named

NEEDED = 6.0
"""Log likelihood that one more cause must gain."""
MATERIAL, MATERIAL_IN_CUFFS = 0.02, 0.1
"""Share of a drive's error, or else of that of the cuffs' torque, that one more cause must take away."""
FINALISTS = 3
"""Sets of each size whose shapes are refined before they are compared."""
LOOKS = 3
"""How often others are taken where none of the finalists can be."""
BEHIND, BEHIND_SHARE = 30.0, 0.2
"""Log likelihood behind the best, or share of the best's, at which a set is no finalist: shapes are coarse yet."""
SOFTENING = 0.25
"""What a log likelihood is worth: the true effect never has exactly our form (docs/diagnosis.md)."""


@dataclass(frozen=True)
class Ranked:
    """A set of causes with its shapes refined."""

    fit: Fit
    score: float
    besides: float = 0.0
    """Of that, what is known of the causes besides what they do to the mean torque."""

    @property
    def labels(self) -> tuple[str, ...]:
        """The causes, sorted."""
        return tuple(sorted(c.label for c in self.fit.causes))


@dataclass(frozen=True)
class Choice:
    """What the search decided."""

    named: Ranked
    levels: list[dict[tuple[str, ...], Scored]]
    refined: list[dict[tuple[str, ...], Ranked]]
    """By size of the set, the empty one first."""
    independent: NDArray
    standby: tuple[Ranked, ...] = ()
    """Sets as worthy as the named one that training hardly tells from it, best first.

    Behind each, the named one too, stands the same with other values in every run of what may differ from run to run.
    """
    freer: Fit | None = None
    """The named set in the best of its freer forms, a cause in two shapes or bent, where one was tried."""
    refuted: frozenset[tuple[str, ...]] = frozenset()
    """Sets that explain the training runs and fail on others."""
    shadows: frozenset[tuple[str, ...]] = frozenset()
    """Sets in which a rhythm of the motion's own takes what other causes leave, or little of all."""
    absurd: Mapping[tuple[str, ...], str] = field(default_factory=dict)
    """Sets that no machine or person has as they were fitted, and why; some other form of them may be there."""

    def next_best(self) -> "Choice | None":
        """Return the choice with the named set refuted and the next of those as good; None where there is none.

        So runs that are never fitted decide only between explanations that are as good as one another. A joint that
        was by chance zeroed alike before all training runs is still the same cause, and explains them as well.
        """
        return replace(self._instead(self.standby[0]), standby=self.standby[1:]) if self.standby else None

    def just(self, causes: Sequence[str]) -> "Choice | None":
        """Return the choice of some of the named causes, the others refuted; None where that is no other set."""
        labels = tuple(sorted(causes))
        ranked = self.refined[len(labels)].get(labels) if labels else None
        return None if ranked is None or labels == self.named.labels else self._instead(ranked)

    def faint(self) -> "Choice | None":
        """Return the choice of the cause that is likely although training hardly shows it; None where there is none.

        A drag that the training motion was too slow for may be plain in another run: that the runs which no fit has
        seen decide, as they do between causes as good as one another.
        """
        likely = [r for r in self.refined[1].values() if r.score > NEEDED] if len(self.refined) > 1 else []
        if self.named.labels or self.refuted or not likely:
            return None
        best, *others = sorted(likely, key=lambda r: -r.score)
        return replace(self, named=best, standby=tuple(r for r in others if r.score > best.score - NEEDED))

    def none_left(self, empty: Fit) -> "Choice":
        """Return the choice of no cause, the named set refuted."""
        return self._instead(Ranked(empty, 0.0))

    def _instead(self, named: Ranked) -> "Choice":
        """Return the choice of another set, the one named so far refuted unless it is of the same causes."""
        refuted = self.refuted | ({self.named.labels} - {named.labels})
        return replace(self, named=named, standby=(), freer=None, refuted=refuted)

    def alone(self, cause: str) -> float:
        """Return what a cause gains in log likelihood with no other beside it."""
        return self.score_of((cause,))

    def score_of(self, labels: tuple[str, ...]) -> float:
        """Return what a set gains in log likelihood, refined, or else as the search has it; nought of no cause."""
        if not labels:
            return 0.0
        fine = self.refined[len(labels)].get(labels)
        return fine.score if fine else self.levels[len(labels) - 1][labels].score


def of_a_freer_form(choice: Choice, scorer: Scorer, empty: Fit) -> dict[str, type[FreerForm]]:
    """Return which named causes add too little to the others where one of those is of a freer form, and of which."""
    found: dict[str, type[FreerForm]] = {}
    for cause in choice.named.fit.causes:
        rest = [other for other in choice.named.fit.causes if other.label != cause.label]
        for other, form in freeable(rest):
            if form.contains(cause.effect, other.effect):
                continue
            # The whole set in the same form: what that repairs of its own cause does not pay for the one left out.
            whole = in_form(choice.named.fit.causes, other.label, form)
            without_it = in_form(rest, other.label, form)
            if _ranked(scorer, without_it, empty).score > _ranked(scorer, whole, empty).score - NEEDED:
                found[cause.label] = form
    return found


def nothing_chosen(empty: Fit) -> Choice:
    """Return the choice of no cause."""
    nothing = Ranked(empty, 0.0)
    return Choice(nothing, [], [{nothing.labels: nothing}], np.zeros(len(empty.rms)))


def choose(bank: Bank, floor: Floor, evidence: Mapping[str, float]) -> Choice:
    """Search, refine the finalists, and stop at the smallest set that nothing improves enough.

    ``evidence`` is what is known of some causes besides what they do to the mean torque, by label.
    """
    count = bank.gram.count.sum(axis=0)
    independent = count * np.minimum(floor.independent_share, MOST_INDEPENDENT)
    scorer = Scorer(bank, independent, evidence)
    levels = search(scorer)
    empty = fit((), bank.runs, bank.baseline, bank.weights)
    named = Ranked(empty, 0.0)
    ranked = [{named.labels: named}]
    freer: list[Ranked] = []
    standby: list[Ranked] = []
    shadows: set[tuple[str, ...]] = set()
    absurd: dict[tuple[str, ...], str] = {}
    for level in levels:
        finalists: list[Ranked] = []
        for _ in range(LOOKS):
            near = _finalists(level, named, scorer, shadows | absurd.keys())
            finalists = [_rank(scorer, s, empty) for s in near]
            shadows |= {r.labels for r in finalists if shadows_motion(r.fit, empty.rms, floor.rms, bank.runs)}
            absurd |= {r.labels: why for r in finalists if (why := r.fit.absurdity(bank.baseline, bank.geometry))}
            finalists = [r for r in finalists if r.labels not in shadows | absurd.keys()]
            if finalists:
                break
        ranked.append({r.labels: r for r in finalists})
        if not finalists:
            break
        freer = _freer(level, named, scorer, empty)
        worthy = [r for r in finalists if all(_worth_it(r, before, scorer) for before in (named, *freer))]
        if not worthy:
            break
        named, *others = sorted(worthy, key=lambda r: -r.score)
        freer, standby = [], [r for r in others if r.score > named.score - NEEDED]
    _, *others = itertools.chain.from_iterable(_and_anew(r, scorer, empty) for r in (named, *standby))
    best = max(freer, key=lambda r: r.score).fit if freer else None
    return Choice(named, levels, ranked, independent, tuple(others), best, shadows=frozenset(shadows), absurd=absurd)


def _and_anew(ranked: Ranked, scorer: Scorer, empty: Fit) -> Iterator[Ranked]:
    """Yield a set, and the same with other values in every run of what may differ from run to run, if any may."""
    yield ranked
    causes = [
        replace(cause, effect=replace(cause.effect, each_run=True)) if cause.effect.may_differ else cause
        for cause in ranked.fit.causes
    ]
    if all(ours.effect == theirs.effect for ours, theirs in zip(causes, ranked.fit.causes, strict=True)):
        return
    made = _ranked(scorer, causes, empty)
    if not made.fit.absurdity(scorer.bank.baseline, scorer.bank.geometry):
        yield made


def _freer(level: dict[tuple[str, ...], Scored], named: Ranked, scorer: Scorer, empty: Fit) -> list[Ranked]:
    """Return the named set in freer forms: the best with a cause in two shapes at once, each with one of them bent."""
    made = [tuple(sorted((*named.labels, label))) for label in named.labels]
    found = [level[labels] for labels in made if labels in level and level[labels].admissible]
    twice = [_rank(scorer, s, empty) for s in sorted(found, key=lambda s: -s.score)[:1]]
    causes = named.fit.causes
    return twice + [_ranked(scorer, in_form(causes, one.label, form), empty) for one, form in freeable(causes)]


def _finalists(
    level: dict[tuple[str, ...], Scored], named: Ranked, scorer: Scorer, barred: Collection[tuple[str, ...]]
) -> list[Scored]:
    """Return the sets that may be best once refined, those that would show at all first; none of those ``barred``.

    Beside the best ones stands the best that extends what is named so far.
    """
    known = known_besides(named.fit.causes, scorer.evidence)

    def shows(s: Scored) -> bool:
        causes = [scorer.bank.candidates[i] for i in s.chosen]
        seen_otherwise = known_besides(causes, scorer.evidence) - known > NEEDED
        return seen_otherwise or bool(np.any(_material(s.error, named.fit.rms, scorer.imperfect)))

    ordered = sorted(
        (
            (labels, s)
            for labels, s in level.items()
            if len(set(labels)) == len(labels) and s.admissible and labels not in barred
        ),
        key=lambda e: (not shows(e[1]), -e[1].score),
    )
    if not ordered:
        return []
    furthest = ordered[0][1].score - max(BEHIND, BEHIND_SHARE * ordered[0][1].score)
    near = [(labels, s) for labels, s in ordered[:FINALISTS] if s.score > furthest]
    extending = [(labels, s) for labels, s in ordered if set(named.labels) < set(labels)][:1]
    return list(dict(near + extending).values())


def _rank(scorer: Scorer, scored: Scored, empty: Fit) -> Ranked:
    """Refine and score a set that the search found."""
    return _ranked(scorer, [scorer.bank.candidates[i] for i in scored.chosen], empty)


def _ranked(scorer: Scorer, causes: Sequence[Candidate], empty: Fit) -> Ranked:
    """Refine a set's shapes and score it on what it was fitted to, less a price for every parameter."""
    bank, independent = scorer.bank, scorer.independent
    best = refined(causes, bank.runs, bank.baseline, bank.weights)
    gain = log_likelihood(best.rms, empty.rms, independent, scorer.imperfect)
    # One that bends the motion has no amplitude of its own, but its shape is as free as one.
    bends = sum(
        c.bends if c.own_bend is None else len(best.columns_of(number).runs) for number, c in enumerate(best.causes)
    )
    ours = sum(len(c.effect.linear) - c.effect.priced for c in best.causes if isinstance(c.effect, FreerForm))
    columns = len(best.values) - len(empty.values) + bends - ours
    besides = sum(_heard_beside(best, label, scorer) for label in {c.label for c in best.causes})
    return Ranked(best, gain + besides - cost(best.causes, columns, independent), besides)


def without(made: Fit, label: str, bank: Bank) -> Fit:
    """Return a fit of all causes but one, their shapes as they were."""
    rest = [cause for cause in made.causes if cause.label != label]
    return fit(rest, bank.runs, bank.baseline, bank.weights)


def _heard_beside(made: Fit, label: str, scorer: Scorer) -> float:
    """Return what is known of a fit's cause besides the mean torque where its others are in: what they explain is not.

    A misfit can be loudest where the load changes sign, too. That others make a cause louder is no evidence for them.
    """
    alone, bank = scorer.evidence.get(label, 0.0), scorer.bank
    if alone <= 0.0 or all(cause.label == label for cause in made.causes):
        return alone
    left = residuals_on(without(made, label, bank), bank.runs, bank.baseline)
    return min(alone, heard_in(bank.runs, left)[label])


def _worth_it(best: Ranked, before: Ranked, scorer: Scorer) -> bool:
    """Tell whether one more cause is likely, shows, and is more than what is always a little off on a good rig."""
    shows = np.any(_material(best.fit.rms, before.fit.rms, scorer.imperfect))
    return best.score - before.score > NEEDED and bool(shows or best.besides - before.besides > NEEDED)


def _material(after: NDArray, before: NDArray, imperfect: NDArray) -> NDArray:
    """Tell at which outputs errors (O,) fall by enough."""
    taken = np.sqrt(np.maximum(before**2 - after**2, 0.0))
    asked = np.repeat([MATERIAL, MATERIAL_IN_CUFFS], len(after) // 2)
    return np.asarray((1.0 - after / np.maximum(before, 1e-12) > asked) & (taken > imperfect))


def dilution(choice: Choice, bank: Bank) -> float:
    """Return how much less the data say between two causes than noise alone would let them, 0 to 1.

    Where the named causes leave more than noise, that is their form's misfit, and it is much alike from sample to
    sample: a likelihood that counts it as noise is sure of the wrong cause.
    """
    left = residuals_on(choice.named.fit, bank.runs, bank.baseline)
    independent = bank.gram.count.sum(axis=0) * independent_share(bank.runs, left)
    return float(min(1.0, independent.sum() / choice.independent.sum()))


def rivals(choice: Choice, scorer: Scorer, empty: Fit, cause: str) -> dict[str, float]:
    """Return every effect that could stand in a named cause's place, and its log likelihood behind the named set.

    The others of the set stay; nought is the named cause itself. None that is more than another of them and explains
    no more: what it is besides does not show. At the joint of the named cause a rival may be of a freer form than its
    own, for the named one has its pick of shapes, too.
    """
    others = tuple(sorted(set(choice.named.labels) - {cause}))
    size = len(choice.named.labels)
    behind: dict[str, float] = {}
    for labels in choice.levels[size - 1]:
        if labels in choice.refuted | choice.shadows:
            continue
        if set(others) <= set(labels) and len(set(labels)) == len(labels) == size:
            rival = next(iter(set(labels) - set(others)))
            apart = min(
                _behind(choice, labels, scorer.bank), _freed_behind(choice, labels, (cause, rival), scorer, empty)
            )
            behind[rival] = max(apart, 0.0) if rival != cause else 0.0
    return {rival: gap for rival, gap in behind.items() if gap <= behind.get(_within(rival), np.inf)}


def _behind(choice: Choice, labels: tuple[str, ...], bank: Bank) -> float:
    """Return the log likelihood of another set behind the named one, both refined, or else both as the search has them.

    A set without a shape to refine is what it is in the search.
    """
    size = len(labels)
    if labels in choice.refined[size]:
        return choice.named.score - choice.refined[size][labels].score
    coarse = choice.levels[size - 1]
    apart = coarse[choice.named.labels].score - coarse[labels].score
    causes = [bank.candidates[i] for i in coarse[labels].chosen]
    if any(p.default is None for cause in causes for p in cause.effect.shape):
        return apart
    return max(apart, choice.named.score - coarse[labels].score)


def _freed_behind(
    choice: Choice, labels: tuple[str, ...], places: tuple[str, str], scorer: Scorer, empty: Fit
) -> float:
    """Return the log likelihood of a set behind the named one if a rival at the cause's joint is of a freer form."""
    cause, rival = (effect_labelled(label) for label in places)
    form = AS_RIVAL.get((type(cause), type(rival)))
    if rival.joint != cause.joint or form is None:
        return np.inf
    chosen = [scorer.bank.candidates[i] for i in choice.levels[len(labels) - 1][labels].chosen]
    made = _ranked(scorer, in_form(chosen, rival.label, form), empty)
    if made.fit.absurdity(scorer.bank.baseline, scorer.bank.geometry):
        return np.inf
    # A law of the angle is any ripple of few waves, in one shape or in two.
    freer = -np.inf if form.alone else _twice(choice, cause.label, scorer, empty)
    return max(choice.named.score, freer) - made.score


def _twice(choice: Choice, label: str, scorer: Scorer, empty: Fit) -> float:
    """Return the log likelihood of the named set with a cause in two shapes at once: it may be freer, too."""
    doubled = tuple(sorted((*choice.named.labels, label)))
    level = choice.levels[len(doubled) - 1] if len(doubled) <= len(choice.levels) else {}
    scored = level.get(doubled)
    return _rank(scorer, scored, empty).score if scored and scored.admissible else -np.inf


def idle(choice: Choice, cause: str) -> frozenset[str]:
    """Return those of a cause's rivals that explain nothing: the others of the set do as well without any.

    Doubt of what the named cause leaves makes all others likelier, those too; but it makes none an explanation.
    """
    others = tuple(sorted(set(choice.named.labels) - {cause}))
    explained = choice.score_of(others)
    sets = [labels for labels in choice.levels[len(others)] if set(others) <= set(labels)]
    return frozenset(
        label for labels in sets if choice.score_of(labels) <= explained for label in set(labels) - {*others, cause}
    )


def in_place_of(choice: Choice, bank: Bank, cause: str, rival: str) -> Effect:
    """Return a rival as it was fitted in a named cause's place."""
    labels = tuple(sorted({*choice.named.labels, rival} - {cause}))
    fine = choice.refined[len(labels)].get(labels)
    coarse = choice.levels[len(labels) - 1][labels]
    causes = fine.fit.causes if fine else [bank.candidates[i] for i in coarse.chosen]
    return next(c.effect for c in causes if c.label == rival)


def _within(label: str) -> str:
    """Return the label of what a cause is more than; empty where it is more than none."""
    effect = effect_labelled(label)
    return effect_named(effect.more_than)(joint=effect.joint).label if effect.more_than else ""


def probabilities(behind: dict[str, float], diluted: float) -> dict[str, float]:
    """Turn log likelihoods behind the best into probabilities, softened for misspecification and ``diluted``."""
    odds = {label: float(np.exp(-SOFTENING * diluted * gap)) for label, gap in behind.items()}
    total = sum(odds.values())
    return {label: odd / total for label, odd in odds.items()}
