"""The evidence of each named cause, and the causes that the data cannot separate from it."""

from typing import Any

from pipelines.contracts.verdict import Cause
from pipelines.report.sections.per_run_values import per_run_values
from pipelines.report.sections.section import Content
from pipelines.wording.causes import cause_in_words


def context(content: Content) -> dict[str, Any]:
    """Return the values of the template's cards of causes."""
    return {"causes": [_cause(cause) for cause in content.session.causes]}


def _cause(cause: Cause) -> dict[str, Any]:
    alike = cause.indistinguishable_from
    ties = [tie.model_dump() | {"words": cause_in_words(tie)} for tie in alike]
    own, evidence = per_run_values(cause), cause.evidence
    return {"words": cause_in_words(cause), "own": own, "evidence": evidence, "ties": ties}
