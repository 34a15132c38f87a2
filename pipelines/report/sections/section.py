"""The input that every section of a report receives."""

from dataclasses import dataclass
from pathlib import Path

from pipelines.contracts.verdict import Verdict
from pipelines.plotting.chart import Chart
from pipelines.report.session import Session


@dataclass(frozen=True)
class Charts:
    """Every chart of a session."""

    hero: Chart | None
    """The chart next to the verdict."""
    measured: tuple[Chart, ...]
    residuals: tuple[Chart, ...]
    control: tuple[Chart, ...]

    @property
    def all(self) -> tuple[Chart, ...]:
        """All charts in the page's order."""
        hero = (self.hero,) if self.hero else ()
        return (*hero, *self.measured, *self.residuals, *self.control)


@dataclass(frozen=True)
class Content:
    """A session and its charts, from which ``context`` of a section makes its template's values."""

    session: Session
    charts: Charts
    title: str | None = None
    output: Path | None = None
    """Where the page is written, for the command line that repeats it."""

    @property
    def verdict(self) -> Verdict | None:
        """The session's verdict; None without a diagnosis."""
        return self.session.verdict
