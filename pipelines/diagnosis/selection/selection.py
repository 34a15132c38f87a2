"""Select causes from the searched runs: library, posterior, answer, findings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import expit, logit

from pipelines.contracts.joints import the
from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.candidates.library import Library, Report, build_library, silent
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.cuff_coherence import cuff_coherence
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns
from pipelines.diagnosis.evidence.residual_shares import ResidualShares, residual_shares
from pipelines.diagnosis.selection.answer import Answer, NamedCause, answer_of
from pipelines.diagnosis.selection.evidence import Element, Evidence
from pipelines.diagnosis.selection.findings import Finding, findings
from pipelines.diagnosis.selection.posterior import (
    SURE,
    Posterior,
    likely_contexts,
    posterior,
    strongest,
)
from pipelines.diagnosis.selection.unlisted_look_alikes import with_look_alikes
from pipelines.effects import EFFECTS
from pipelines.errors import InputError


@dataclass(frozen=True)
class Selection:
    """The answer from the searched runs, before and after the validation runs judge it.

    The training runs are searched. Where their named causes leave more than noise on the validation
    runs, all runs are searched.
    """

    library: Library | None
    """None where faults of acquisition prevent a search."""
    evidence: Evidence | None
    searched: Posterior | None
    """The probability of each set from the searched runs."""
    posterior: Posterior | None
    """The same after judging: charges of the validation runs, then look-alikes."""
    answer: Answer
    findings: tuple[Finding, ...]
    router: tuple[ResidualShares, ...]
    """Of each joint: how its residual repeats, in the searched runs."""
    dropped: frozenset[str] = frozenset()
    """Labels that were named until the validation runs contradicted them."""
    charged: Mapping[str, float] = field(default_factory=dict)
    """Log odds that the validation runs subtract, by variant of a cause: its harm, or how far it
    falls behind the best of its ties, which has zero."""

    removed: Mapping[str, float] = field(default_factory=dict)
    """Share of the validation runs' systematic error that each cause removed when it was tested for
    being a look-alike, by label."""

    training_alone: tuple[str, ...] | None = None
    """Of a search of all runs: labels that the training runs alone name, before validation."""

    @property
    def shows_something(self) -> bool:
        """Whether it is more likely than not that something is missing."""
        return 1.0 - self.answer.nothing >= CRITERIA.named_from

    @property
    def shows_unlisted(self) -> bool:
        """Whether it is more likely than not that something unlisted is missing."""
        return self.answer.unlisted >= CRITERIA.named_from

    @property
    def names_all(self) -> bool:
        """Whether causes are named, and it is likely that nothing unlisted is missing as well."""
        return bool(self.answer.named) and not self.shows_unlisted

    @property
    def without_names(self) -> "Selection":
        """The same findings without named causes, which the validation runs contradict."""
        assert self.posterior is not None
        answer = replace(self.answer, named=())
        findings_now = tuple(findings(self.posterior, answer))
        return replace(
            self, answer=answer, findings=findings_now, dropped=frozenset(self.answer.labels)
        )

    def as_all_runs_search(self, first: "Selection") -> "Selection":
        """Mark the result of all runs, after the training runs alone gave ``first``."""
        assert first.searched is not None
        return replace(self, training_alone=answer_of(first.searched).labels)

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The named causes at their most probable shapes, in the searched runs."""
        return tuple(self._candidate(one.element) for one in self.answer.named)

    def _candidate(self, element: Element) -> Candidate:
        assert self.library is not None
        return self.library.causes[element.library_number].candidate

    @property
    def doubted(self) -> frozenset[str]:
        """Labels that harm the validation runs, or that a tie of theirs predicts better."""
        return frozenset(e.label for e in self._elements if self.charged.get(e.variant, 0.0) < 0.0)

    def worst_harm(self, ratios: Mapping[str, float]) -> dict[str, float]:
        """Return the charges for the named cause that harms the validation runs most, by variant.

        The result is empty if none does.

        Parameters
        ----------
        ratios : mapping of str to float
            Log likelihood of the validation runs with a named cause over that without it, by label.
        """
        # A cause with a size of its own in each run is not charged: one run is no evidence of
        # another's.
        judged = [
            (ratios.get(one.element.label, 0.0), one.members)
            for one in self.answer.named
            if not one.element.sized_each_run
        ]
        harmful = [(ratio, members) for ratio, members in judged if ratio < 0.0]
        for ratio, members in sorted(harmful, key=lambda pair: pair[0]):
            # A harmful cause's ties harm too, because these data cannot separate them.
            alike = {
                e.variant for e in self._elements if e.label in members and not e.sized_each_run
            }
            charges = {variant: ratio for variant in alike if not self.charged.get(variant)}
            if charges:
                return charges
        return {}

    def rivals_of(self, number: int) -> dict[str, Candidate]:
        """Return the ties to fit in the place of a named cause, by variant.

        Ties that were compared before are left out, and so is a cause with a size of its own in
        each run: a validation run fits its own.
        """
        one = self.answer.named[number]
        if one.element.variant in self.charged or one.element.sized_each_run:
            return {}
        ties = [self._best_shape(label, one) for label, _ in one.ties]
        return {
            tie.variant: self._candidate(tie)
            for tie in ties
            if tie.variant not in self.charged and not tie.sized_each_run
        }

    def judged(self, charges: Mapping[str, float], *, harms: bool = False) -> "Selection":
        """Return the answer after further charges.

        Parameters
        ----------
        charges : mapping of str to float
            Log odds that the validation runs subtract as well, zero or negative, by variant of a
            cause.
        harms : bool
            Whether the model predicts these runs worse with the charged cause, which is then
            reported as dropped.
        """
        assert self.searched is not None
        charged = {**self.charged, **charges}
        # A charge moves probability to other sets, and must not lower causes that did no harm.
        floors = {one.members: _lowered(one, charges, self._elements) for one in self.answer.named}
        weighed = _with_floors(self.searched.judged(charged), floors)
        again = replace(self._reweighed(weighed), charged=charged)
        doubted = {
            one.element.label
            for one in self.answer.named
            if harms and one.element.variant in charges
        }
        return replace(again, dropped=(self.dropped | doubted) - set(again.answer.labels))

    def _reweighed(self, weighed: Posterior) -> "Selection":
        """Return the answer of another posterior; only causes named or tied before may be named."""
        likely = answer_of(weighed, [one.members for one in self.answer.named])
        # Other causes that become likely are findings only: refuting one cause is no evidence for
        # another.
        named = tuple(one for one in likely.named if one.element.label in self.answer.members)
        answer = replace(likely, named=named)
        return replace(
            self, posterior=weighed, answer=answer, findings=tuple(findings(weighed, answer))
        )

    def with_look_alikes(self, removed: Mapping[str, float]) -> "Selection":
        """Return the answer in which named causes may be unlisted effects that resemble them.

        Parameters
        ----------
        removed : mapping of str to float
            Share of the systematic error of the validation runs that each named cause removes, by
            label.
        """
        if self.posterior is None or not removed:
            return self
        named = [one for one in self.answer.named if one.element.label in removed]
        shares = {one.members: removed[one.element.label] for one in named}
        weighed = with_look_alikes(self.posterior, shares)
        return replace(self._reweighed(weighed), removed=dict(removed))

    @property
    def _elements(self) -> tuple[Element, ...]:
        return () if self.searched is None else self.searched.elements

    def _best_shape(self, label: str, one: NamedCause) -> Element:
        """Return the most probable shape of a tie in the place of a named cause."""
        assert self.posterior is not None
        labels = map(self.posterior.labels_of, self.posterior.sets)
        has_it = [
            (own, chosen)
            for own, chosen in zip(labels, self.posterior.sets, strict=True)
            if label in own
        ]
        rest = {other.element.label for other in self.answer.named} - {one.element.label}
        in_place = (
            chosen for own, chosen in has_it if rest <= own and one.element.label not in own
        )
        # Perhaps no weighed set has the tie in its place: then its best set shows the shape.
        best = next(in_place, has_it[0][1])
        elements = (self.posterior.elements[i] for i in best)
        return next(element for element in elements if element.label == label)


def _lowered(one: NamedCause, charges: Mapping[str, float], elements: Sequence[Element]) -> float:
    """Return the probability of a named cause and its ties after the smallest of their charges.

    It was fitted without the other charged causes, so their charges do not lower it.
    """
    own = [charges[e.variant] for e in elements if e.label in one.members and e.variant in charges]
    return float(expit(logit(min(one.probability, SURE)) + max(own, default=0.0)))


def _with_floors(weighed: Posterior, floors: Mapping[frozenset[str], float]) -> Posterior:
    """Return the posterior where each group of labels has at least its least probability."""
    # To raise one group lowers the others, so they take turns until none changes.
    for _ in range(50):
        before = weighed
        for members, probability in floors.items():
            weighed = weighed.at_least(members, probability)
        if weighed is before:
            break
    return weighed


def select(prepared: PreparedRuns, report: Report = silent) -> Selection:
    """Weigh all sets of causes and laws, and read the answer off the posterior.

    Raises
    ------
    InputError
        Where the noise of a joint's torque cannot be measured.
    """
    _refuse_unknown_noise(prepared)
    library, evidence, result = weighed(prepared, report)
    answer = answer_of(result)
    return Selection(
        library,
        evidence,
        result,
        result,
        answer,
        tuple(findings(result, answer)),
        _router(prepared),
    )


def _refuse_unknown_noise(prepared: PreparedRuns) -> None:
    """Raise InputError where too little of a joint's torque is usable to measure its noise."""
    for j, joint in enumerate(prepared.baseline.joints):
        measured = prepared.baseline.machine.measured[j]
        if measured and not np.isfinite(prepared.noise.density[j]):
            usable = sum(int(run.usable[:, j].sum()) for run in prepared.runs)
            raise InputError(
                f"{', '.join(run.motion.file for run in prepared.runs)}: {usable} blocks of"
                f" {the(joint)} are usable, too few in any 20 s to separate noise from error;"
                " record with fewer gaps, or longer"
            )


def nothing_selected(prepared: PreparedRuns) -> Selection:
    """Return the empty answer where faults of acquisition prevent a search."""
    return Selection(None, None, None, None, Answer((), 0.0, 0.0), (), _router(prepared))


def weighed(prepared: PreparedRuns, report: Report = silent) -> tuple[Library, Evidence, Posterior]:
    """Return the library, its evidence, and the probability of each set.

    Causes are refined alone first, then together with the others of likely sets.
    """
    # Position of the progress bar at which the library is done.
    library_share = 0.6
    library = build_library(prepared, lambda share, what: report(library_share * share, what))
    report(library_share, "posterior")
    auxiliary = _auxiliary(prepared)
    evidence = Evidence.of(library, auxiliary)
    result = posterior(evidence)
    # The first posterior names sets that are worth a joint refinement, which is expensive.
    refined = library
    # Number of causes that are refined together with each of the most probable ones.
    partners = 5
    for number in strongest(result):
        refined = refined.with_partners(number, partners)
    refined = refined.refined_together(likely_contexts(result))
    if refined is library:
        return library, evidence, result
    evidence = Evidence.of(refined, auxiliary)
    return refined, evidence, posterior(evidence)


def _auxiliary(prepared: PreparedRuns) -> dict[str, float]:
    """Return log likelihood ratios of causes from evidence other than the mean torque, by label.

    It is the part of the torque that cuffs and drives share, for effects with ``cuff_coherence``. A
    rhythm that is fitted explains some of it too.
    """
    ratios = cuff_coherence(prepared.runs, prepared.residuals)
    return {
        effect(joint=joint).label: float(ratio)
        for effect in EFFECTS
        if effect.cuff_coherence
        for joint, ratio in zip(prepared.baseline.joints, ratios, strict=True)
    }


def _router(prepared: PreparedRuns) -> tuple[ResidualShares, ...]:
    return tuple(residual_shares(prepared.runs, prepared.residuals, prepared.noise))
