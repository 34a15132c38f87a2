"""Values of a named cause that differ from run to run: a zero, an onset, a phase."""

from dataclasses import dataclass

from pipelines.contracts.verdict import Cause, OneRun
from pipelines.report.sections.parameters import Estimate


@dataclass(frozen=True)
class RunValues:
    """One run's row."""

    file: str
    purpose: str
    estimates: tuple[Estimate | None, ...]
    """One per parameter; None if the cause does not occur in this run."""


@dataclass(frozen=True)
class PerRunValues:
    """A table of all runs."""

    headings: tuple[str, ...]
    """Each parameter with its unit."""
    runs: tuple[RunValues, ...]


def per_run_values(cause: Cause) -> PerRunValues | None:
    """Return a cause's values in each run; None if all runs share them."""
    if not cause.each_run:
        return None
    units = {one.name: "" if one.unit == "1" else one.unit for one in cause.parameters}
    names = tuple(cause.each_run[0].values)
    titles = [(name.replace("_", " "), units.get(name, "")) for name in names]
    rows = []
    for run in cause.each_run:
        estimates = tuple(_estimate(cause, run, name, units) for name in names)
        rows.append(RunValues(run.file, run.purpose, estimates))
    return PerRunValues(tuple(", ".join(filter(None, title)) for title in titles), tuple(rows))


def _estimate(cause: Cause, run: OneRun, name: str, units: dict[str, str]) -> Estimate | None:
    value = run.values.get(name)
    low, high = run.ci95.get(name) or (None, None)
    if value is None:
        return None
    effect, joint, unit = cause.effect, cause.joint or "", units.get(name, "")
    return Estimate(effect, name, name, joint, run.file, unit, value, low, high)
