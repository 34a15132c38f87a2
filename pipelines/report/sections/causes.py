"""The evidence of each named cause, and the causes that the data cannot separate from it."""

from typing import Any

from pipelines.report.sections.per_run_values import per_run_values
from pipelines.report.sections.section import Content
from pipelines.wording.causes import cause_in_words, ties_of


def context(content: Content) -> dict[str, Any]:
    """Return the values of the template's cards of causes."""
    causes = content.verdict["causes"] if content.verdict else []
    return {"causes": [_cause(cause) for cause in causes]}


def _cause(cause: dict[str, Any]) -> dict[str, Any]:
    return {
        "words": cause_in_words(cause),
        "own": per_run_values(cause),
        "evidence": cause["evidence"],
        "ties": [
            {
                "words": cause_in_words(tie),
                "probability": tie.get("probability"),
                "why": tie["why"],
                "how": tie["how_to_separate"],
            }
            for tie in ties_of(cause)
        ],
    }
