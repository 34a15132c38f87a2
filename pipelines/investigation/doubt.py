"""What a verdict leaves open: a choice between causes, or between causes and none."""

from dataclasses import dataclass, field
from enum import Enum

from pipelines.contracts.verdict import Finding, Posterior, Verdict
from pipelines.investigation.law_shape import can_be_planned
from pipelines.wording.label import NOTHING, label_in_words

DECIDED = 0.95
"""Posterior probability of one rival from which the others are excluded."""
CLOSE = 1.0 - DECIDED
"""Probability from which a rival keeps the others from being decided."""


class State(Enum):
    """What a verdict says of what is missing."""

    AT_FAULT = "at_fault"
    """Acquisition is at fault, so that nothing is said of physics."""
    NOTHING = "nothing"
    NAMED = "named"
    """Each finding is one cause that has ``DECIDED``."""
    OPEN = "open"
    """There is a choice, which an experiment may decide."""
    UNLISTED = "unlisted"
    """Something is missing, and it is no choice between listed causes."""


@dataclass(frozen=True)
class Doubt:
    """The doubt that a verdict leaves."""

    state: State
    words: str
    probabilities: dict[str, float] = field(default_factory=dict)
    """Of the rivals by their labels, if the state is open.

    Their sum may exceed one where a set of causes has two of them."""


def doubt_of(verdict: Verdict) -> Doubt:
    """Return what a verdict leaves open."""
    if verdict.acquisition_at_fault or verdict.posterior is None:
        return Doubt(State.AT_FAULT, "acquisition is at fault; correct it and record again")
    posterior = verdict.posterior
    if not verdict.findings:
        close = {label: p for label, p in posterior.causes.items() if p >= CLOSE}
        if close:
            return _open({NOTHING: posterior.nothing_missing, **close})
        words = f"nothing that the recordings could show ({_rounded(posterior.nothing_missing)})"
        if posterior.unlisted >= CLOSE:
            return _with_law(words)
        return Doubt(State.NOTHING, f"missing is {words}")
    unsettled = [one for one in verdict.findings if not _is_settled(one)]
    named = {one.label for finding in verdict.findings for one in finding.causes}
    for finding in unsettled:
        rivals = _rivals(finding, posterior, named)
        if len(rivals) > 1:
            return _open(rivals)
    if unsettled:
        return _with_law(f"{unsettled[0].words} ({_rounded(unsettled[0].probability)})")
    settled = ", ".join(f"{f.words} ({_rounded(f.probability)})" for f in verdict.findings)
    return Doubt(State.NAMED, f"decided: {settled}")


def _open(rivals: dict[str, float]) -> Doubt:
    words = (f"{label_in_words(label)} ({_rounded(p)})" for label, p in rivals.items())
    return Doubt(State.OPEN, f"open: {' or '.join(words)}", rivals)


def _with_law(words: str) -> Doubt:
    return Doubt(
        State.UNLISTED,
        f"open: {words}, or an unlisted law; no motion can be planned to decide that",
    )


def _rounded(probability: float) -> str:
    """Return a probability in words, and never ``DECIDED`` for one that is below it."""
    text = f"{probability:.2f}"
    return f"{probability:.4f}" if probability < DECIDED <= float(text) else text


def _is_settled(finding: Finding) -> bool:
    """Return whether one cause of a finding has ``DECIDED``."""
    alone = max((one.probability for one in finding.causes if not one.dropped), default=0.0)
    return finding.level == "cause" and alone >= DECIDED


def _rivals(finding: Finding, posterior: Posterior, named: set[str]) -> dict[str, float]:
    """Return the rivals of a finding; fewer than two where there is no choice.

    ``named`` has the labels of the causes of all findings.
    """
    rivals = {
        one.label: one.probability
        for one in finding.causes
        if not one.dropped and one.probability >= CLOSE
    }
    if finding.level != "cause":
        return rivals
    rest = 1.0 - finding.probability
    # A law that is more probable than the rest is there as well, and not in the finding's place.
    # A few sets have both.
    laws = {label: p for label, p in posterior.laws.items() if CLOSE <= p <= rest + CLOSE}
    rivals |= {label: p for label, p in laws.items() if can_be_planned(label)}
    rest -= posterior.unlisted
    for label, p in posterior.causes.items():
        if label not in named and CLOSE <= p <= rest:
            rivals[label] = p
            rest -= p
    if rest >= CLOSE:
        rivals[NOTHING] = rest
    elif len(rivals) == 1 and posterior.unlisted < CLOSE:
        # The rest is spread, and the nearest is that this finding is none.
        rivals[NOTHING] = 1.0 - finding.probability
    return rivals
