"""The two cards of the decision: whether something is missing, and how the residual splits."""

from dataclasses import dataclass
from typing import Any

from pipelines.contracts.verdict import Verdict
from pipelines.report.sections.error_budget import torque_unit
from pipelines.report.sections.section import Content
from pipelines.wording.findings import PARTS, Row, Shares, outcomes, rows, searched_runs, shares

OUTCOMES = {"nothing": "noise", "listed": "cause1", "unlisted": "unlisted"}
TONES = {
    "noise": "noise",
    "wanders": "wanders",
    "between_runs": "runs",
    "unsplit": "before",
    "repeats": "left",
}
"""Names of colours, in the order in which the parts are laid end to end."""


@dataclass(frozen=True)
class Part:
    """A part of a bar whose whole is one."""

    words: str
    tone: str
    """Name of its colour."""
    low: float
    share: float


@dataclass(frozen=True)
class Split:
    """How one joint's residual splits."""

    joint: str
    unit: str
    rms: float
    parts: tuple[Part, ...]
    with_person_only: float | None
    predicted: dict[str, float]
    """Share of the variance that a curve of one variable predicts."""


@dataclass(frozen=True)
class Decision:
    """The two cards of the first screen."""

    outcomes: tuple[Part, ...]
    """Nothing missing, listed causes only, something unlisted."""
    rows: tuple[Row, ...]
    splits: tuple[Split, ...]
    searched: str
    """The runs whose residual is split."""


def context(content: Content) -> dict[str, Any]:
    """Return the values of the template's cards of the decision."""
    return {"decision": decision(content.verdict) if content.verdict else None}


def decision(verdict: Verdict) -> Decision | None:
    """Return a verdict's decision; None in files of older versions."""
    cases = outcomes(verdict)
    if not cases:
        return None
    shown = [(case.words, OUTCOMES[case.key], case.probability) for case in cases]
    splits = tuple(_split(verdict, one) for one in shares(verdict))
    return Decision(_end_to_end(shown), tuple(rows(verdict)), splits, searched_runs(verdict))


def _split(verdict: Verdict, one: Shares) -> Split:
    parts = [(PARTS[name], tone, one.parts[name]) for name, tone in TONES.items()]
    unit, shown = torque_unit(verdict, one.joint), _end_to_end(parts)
    return Split(one.joint, unit, one.rms, shown, one.with_person_only, one.predicted)


def _end_to_end(shares: list[tuple[str, str, float]]) -> tuple[Part, ...]:
    # The page draws each part from its own start, so that it needs no sums.
    parts, low = [], 0.0
    for words, tone, share in shares:
        parts.append(Part(words, tone, low, share))
        low += share
    return tuple(parts)
