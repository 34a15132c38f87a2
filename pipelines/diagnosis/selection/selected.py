"""What the evidence of the training runs says: the library, the posterior, and the answer read off it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from pipelines.diagnosis.candidates.auxiliary_evidence import auxiliary_evidence
from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.candidates.library import Library, build_library, silent
from pipelines.diagnosis.evidence.prepared_runs import Prepared, prepare
from pipelines.diagnosis.evidence.residual_shares import ResidualShares, residual_shares
from pipelines.diagnosis.selection.answer import Answer, Named, answer_of
from pipelines.diagnosis.selection.evidence import Element, Evidence
from pipelines.diagnosis.selection.findings import Finding, findings
from pipelines.diagnosis.selection.posterior import Posterior, likely_contexts, posterior, strongest
from pipelines.diagnosis.training_data import training_data
from pipelines.mechanics.motion import Motion

LIBRARY_SHARE = 0.6
"""Of the progress bar, where the library is done."""
PARTNERS = 5
"""Causes that are refined beside a strong one."""
Report = Callable[[float, str], None]


@dataclass(frozen=True)
class Selected:
    """What the evidence says, before anything is fitted."""

    library: Library | None
    """None where faults of acquisition keep physics from being looked at."""
    evidence: Evidence | None
    trained: Posterior | None
    """How probable each set is by the training runs."""
    posterior: Posterior | None
    """The same after validation."""
    answer: Answer
    findings: tuple[Finding, ...]
    router: tuple[ResidualShares, ...]
    """Of each joint: how its residual repeats."""
    dropped: frozenset[str] = frozenset()
    """Labels that the training runs would name, and the validation runs speak against."""
    charged: Mapping[str, float] = field(default_factory=dict)
    """What harm on the validation runs takes from log odds, by variant of a cause."""

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The named causes at their most probable shapes."""
        if self.library is None:
            return ()
        return tuple(self.library.causes[one.element.place].candidate for one in self.answer.named)

    def harm_of(self, label: str, ratio: float) -> dict[str, float]:
        """Return what harm on the validation runs takes from log odds, by variant that was not charged yet.

        Where a named cause does harm, so do its ties: these data cannot tell them apart. A value that each run has for
        itself is not charged, for one run says nothing of another's.

        Parameters
        ----------
        label : str
            Of a named cause.
        ratio : float
            Log likelihood of the validation runs with it over that without it.
        """
        if self.trained is None or ratio >= 0.0:
            return {}
        one = next(one for one in self.answer.named if one.element.label == label)
        alike = {e.variant for e in self.trained.elements if e.label in one.members and not e.each_run}
        return dict.fromkeys(alike - self.charged.keys(), ratio)

    def rivals_of(self, number: int) -> dict[str, Candidate]:
        """Return the ties of a named cause in its place, by variant, those that were compared already left out.

        A value that each run has for itself is not compared: a validation run fits its own.
        """
        one, found = self.answer.named[number], dict[str, Candidate]()
        own, *elements = (self._standing(label, one) for label in (one.element.label, *dict(one.ties)))
        if own.variant in self.charged or self._candidate(own).effect.sized_each_run:
            return {}
        for element in elements:
            candidate = self._candidate(element)
            if element.variant not in self.charged and not candidate.effect.sized_each_run:
                found[element.variant] = candidate
        return found

    def _candidate(self, element: Element) -> Candidate:
        assert self.library is not None
        return self.library.causes[element.place].candidate

    def _standing(self, label: str, one: Named) -> Element:
        """Return a label at its most probable shape in the place of a named cause."""
        weighed = self.posterior
        assert weighed is not None
        rest = {other.element.label for other in self.answer.named} - {one.element.label}
        has_it = [chosen for chosen in weighed.sets if label in weighed.labels_of(chosen)]
        best = next((chosen for chosen in has_it if weighed.labels_of(chosen) == rest | {label}), has_it[0])
        return next(e for i in best if (e := weighed.elements[i]).label == label)

    def judged(self, charges: Mapping[str, float], *, harms: bool = False) -> "Selected":
        """Return the same where the validation runs take this from log odds as well, by variant of a cause.

        What takes the place of a cause is named where it was named or tied before. Else it is a finding: that another
        is refuted says nothing for it. ``harms`` tells that the model predicts these runs worse with the cause.
        """
        assert self.trained is not None
        charged = {**self.charged, **charges}
        weighed = self.trained.judged(charged)
        for one in self.answer.named:
            own = [charged[e.variant] for e in weighed.elements if e.label in one.members and e.variant in charged]
            # One of them does no harm: what others do, or how far its ties fall behind it, takes nothing from them.
            if max(own, default=0.0) == 0.0:
                weighed = weighed.holding(one.members, one.probability)
        likely = answer_of(weighed)
        named = tuple(one for one in likely.named if one.element.label in self.answer.members)
        answer = replace(likely, named=named)
        doubted = {one.element.label for one in self.answer.named if harms and one.element.variant in charges}
        dropped = (self.dropped | doubted) - {one.element.label for one in named}
        found = tuple(findings(weighed, answer))
        return replace(self, posterior=weighed, answer=answer, findings=found, charged=charged, dropped=dropped)


def select(prepared: Prepared, report: Report = silent) -> Selected:
    """Weigh all sets of causes and laws, and read the answer off the posterior."""
    library, evidence, found = weighed(prepared, report)
    answer = answer_of(found)
    return Selected(library, evidence, found, found, answer, tuple(findings(found, answer)), _router(prepared))


def evidence_of(motions: Sequence[Motion], known: Sequence[str] = ()) -> Evidence:
    """Return what the decision needs of a session."""
    data = training_data(motions, known)
    prepared = prepare(data.train, data.baseline)
    return weighed(prepared)[1]


def nothing_selected(prepared: Prepared) -> Selected:
    """Return the answer where faults of acquisition keep physics from being looked at."""
    return Selected(None, None, None, None, Answer((), 0.0, 0.0), (), _router(prepared))


def weighed(prepared: Prepared, report: Report = silent) -> tuple[Library, Evidence, Posterior]:
    """Return the library, its evidence, and how probable each set is.

    Causes are refined alone first, then beside the others of likely sets.
    """
    library = build_library(prepared, lambda share, what: report(LIBRARY_SHARE * share, what))
    report(LIBRARY_SHARE, "posterior")
    auxiliary = auxiliary_evidence(prepared)
    evidence = Evidence.of(library, auxiliary)
    found = posterior(evidence)
    refined = library
    for number in strongest(found):
        refined = refined.with_partners(number, PARTNERS)
    refined = refined.refined_together(likely_contexts(found))
    if refined is library:
        return library, evidence, found
    evidence = Evidence.of(refined, auxiliary)
    return refined, evidence, posterior(evidence)


def _router(prepared: Prepared) -> tuple[ResidualShares, ...]:
    return tuple(residual_shares(prepared.runs, prepared.residuals, prepared.noise))
