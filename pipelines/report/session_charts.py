"""Every chart of a session, for the page and for figure files."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from pipelines.plotting.chart import Chart, thinned_alike
from pipelines.report.sections.control import control_charts
from pipelines.report.sections.fit_quality import angle_charts, torque_charts
from pipelines.report.sections.key_figures import worst_joint
from pipelines.report.sections.residuals import most_explained_variable, residual_charts
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


def charts(session: Session, values: int | None = None) -> Charts:
    """Return the charts of a session, thinned to a total of ``values`` numbers, if given."""
    groups = [
        [*torque_charts(session), *angle_charts(session)],
        list(residual_charts(session)),
        list(control_charts(session)),
    ]
    # Thinned together, because the limit is of the whole page; then back into their groups.
    flat = [chart for group in groups for chart in group]
    thin = iter(flat if values is None else thinned_alike(flat, values))
    measured, residuals, control = (tuple(next(thin) for _ in group) for group in groups)
    return Charts(_hero(session, residuals), measured, residuals, control)


def _hero(session: Session, residuals: Sequence[Chart]) -> Chart | None:
    joint = worst_joint(session)
    if joint is None:
        return None
    variable = most_explained_variable(session, joint).replace("_", "-")
    key = f"residual-{joint.name}-{variable}"
    # A copy with another key, as the same chart also stands among the residuals.
    return next((replace(chart, key="verdict") for chart in residuals if chart.key == key), None)
