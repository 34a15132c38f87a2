"""The two cards of the decision: whether something is missing, and how the residual splits."""

from typing import Any

from pipelines.contracts.verdict import Verdict
from pipelines.report.sections.error_budget import torque_unit
from pipelines.wording import detection_lines
from pipelines.wording.findings import PARTS, Shares, outcomes, rows, searched_runs, shares


def decision(verdict: Verdict) -> dict[str, Any] | None:
    """Return the values of the template's two cards; None for files of older versions."""
    cases = outcomes(verdict)
    if not cases:
        return None
    tones = {"nothing": "noise", "listed": "cause1", "unlisted": "unlisted"}
    return {
        "outcomes": _end_to_end([(one.words, tones[one.key], one.probability) for one in cases]),
        "rows": rows(verdict),
        "splits": [_split(verdict, one) for one in shares(verdict)],
        "searched": searched_runs(verdict),
        "lines": _lines(verdict),
    }


def _lines(verdict: Verdict) -> dict[str, Any] | None:
    """Return the table of what detection lines show; None for motions without them."""
    if not verdict.detection_lines:
        return None
    return {
        "headings": detection_lines.HEADINGS,
        "rows": detection_lines.rows(verdict),
        "notes": detection_lines.notes(verdict),
    }


def _split(verdict: Verdict, one: Shares) -> dict[str, Any]:
    # Names of colours, in the order in which the parts are laid end to end.
    tones = {
        "noise": "noise",
        "wanders": "wanders",
        "between_runs": "runs",
        "unsplit": "before",
        "repeats": "left",
    }
    parts = [(PARTS[name], tone, one.parts[name]) for name, tone in tones.items()]
    return vars(one) | {"unit": torque_unit(verdict, one.joint), "parts": _end_to_end(parts)}


def _end_to_end(shares: list[tuple[str, str, float]]) -> list[dict[str, Any]]:
    """Return parts of a bar whose whole is one, from their words, colours and shares."""
    # The page draws each part from its own start, so that it needs no sums.
    parts, low = [], 0.0
    for words, tone, share in shares:
        parts.append({"words": words, "tone": tone, "low": low, "share": share})
        low += share
    return parts
