"""Each named cause: its evidence, its values in each run, and causes that look the same."""

from typing import Any

from pipelines.contracts.verdict import Cause, OneRun
from pipelines.report.sections.parameters import Estimate
from pipelines.wording.causes import cause_in_words


def card(cause: Cause) -> dict[str, Any]:
    """Return the values of the template's card of a cause."""
    alike = cause.indistinguishable_from
    return {
        "words": cause_in_words(cause),
        "own": _own(cause) if cause.each_run else None,
        "evidence": cause.evidence,
        "ties": [tie.model_dump() | {"words": cause_in_words(tie)} for tie in alike],
    }


def _own(cause: Cause) -> dict[str, Any]:
    """Return the values that differ from run to run: a zero, an onset, a phase."""
    units = {one.name: "" if one.unit == "1" else one.unit for one in cause.parameters}
    names = list(cause.each_run[0].values)
    runs = []
    for run in cause.each_run:
        estimates = [_estimate(cause, run, name, units.get(name, "")) for name in names]
        runs.append({"file": run.file, "purpose": run.purpose, "estimates": estimates})
    headings = [(name.replace("_", " "), units.get(name, "")) for name in names]
    return {"headings": [", ".join(filter(None, one)) for one in headings], "runs": runs}


def _estimate(cause: Cause, run: OneRun, name: str, unit: str) -> Estimate | None:
    """Return a value in one run; None if the cause does not occur in it."""
    value = run.values.get(name)
    if value is None:
        return None
    low, high = run.ci95.get(name) or (None, None)
    return Estimate(cause.effect, name, name, cause.joint or "", run.file, unit, value, low, high)
