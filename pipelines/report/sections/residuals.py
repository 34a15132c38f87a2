"""Residuals of each model against angle, speed, load and time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from pipelines.contracts import Joint
from pipelines.contracts.verdict import Dependence
from pipelines.plotting.chart import Chart
from pipelines.plotting.residual_panels import residual_panel, residual_reach
from pipelines.report.sections.fit_quality import drawn, models_of
from pipelines.report.session import Session
from pipelines.signals.binned_mean import FEWEST


@dataclass(frozen=True)
class Against:
    """One column that residuals are drawn against."""

    variable: str
    """Its name in the verdict's ``depends_on``."""
    title: str
    label: str
    column: str


def by_joint(session: Session, charts: Sequence[Chart]) -> list[dict[str, Any]]:
    """Return each joint with its charts, and the variables on which its error depends."""
    rows = []
    for joint in session.measured_joints:
        own = [chart for chart in charts if chart.key.startswith(f"residual-{joint.name}-")]
        if own:
            rows.append({"name": joint.name, "charts": own, "depends": _predicted(session, joint)})
    return rows


def _predicted(session: Session, joint: Joint) -> list[dict[str, Any]]:
    """Return variables in words, and the share of the error that each predicts."""
    titles = {one.variable: one.title for one in _against(session, joint)}
    return [
        {
            "words": titles.get(one.variable, one.variable.replace("_", " ")),
            "before": one.share_before,
            "after": one.share_after if session.causes else None,
        }
        for one in session.dependences(joint)
    ]


def _against(session: Session, joint: Joint) -> list[Against]:
    """Return the columns against which a joint's residuals are drawn.

    With two joints, the other joint's columns are included.
    """
    # Variables of the verdict's `depends_on`, by quantity of the residuals' table.
    variables = {
        "angle": "angle",
        "velocity": "speed",
        "acceleration": "acceleration",
        "torque": "load",
    }
    charts = [_along(joint, quantity, variable) for quantity, variable in variables.items()]
    for other in session.joints:
        if other != joint and len(session.joints) == 2:
            for quantity, variable in variables.items():
                has_values = other.is_measured or variable != "load"
                if variable != "acceleration" and has_values:
                    charts.append(_along(other, quantity, f"other_{variable}"))
    return [*charts, Against("time", "time", "time, s", "time_s")]


def _along(joint: Joint, quantity: str, variable: str) -> Against:
    words = variable.removeprefix("other_")
    words = joint.place if words == "angle" else words
    title = f"{joint.name} {words}"
    return Against(variable, title, f"{title}, {joint.unit(quantity)}", joint.column(quantity))


def residual_charts(session: Session) -> Iterator[Chart]:
    """Yield a chart for each joint and variable, on validation runs."""
    if session.residuals is None:
        return
    frame = session.residuals.frame
    # Runs that no fit has seen, without reversals: no model of speed predicts a standing joint.
    judged = frame[frame["scored"] & (frame["purpose"] == "validate")]
    models = [drawn(model, judged[judged["model"] == model]) for model in models_of(session)]
    for joint in session.measured_joints:
        # One height for all charts of a joint, so that their errors can be compared.
        reach = residual_reach(judged, joint)
        for one in _against(session, joint):
            x, panel = residual_panel(joint, one.column, models, reach, session.noise_floor(joint))
            yield Chart(
                key=f"residual-{joint.name}-{one.variable.replace('_', '-')}",
                title=f"{joint.name} error against {one.title}",
                caption=(
                    "Dots are blocks of validation runs away from reversals, lines their running"
                    f" means, each of {FEWEST} blocks or more; the band is the noise floor."
                ),
                x_label=one.label,
                x=x,
                panels=(panel,),
            )


def most_explained_variable(session: Session, joint: Joint) -> str:
    """Return the variable whose predicted error the named causes reduce most.

    Without a cause it is the variable that predicts most of the error. Shares are relative to each
    model's residual variance, so they are weighted by its mean square.
    """
    verdict = session.verdict
    known = {one.variable for one in _against(session, joint)}
    ranking = [one for one in session.dependences(joint) if one.variable in known]
    if verdict is None or not ranking:
        return "angle"
    # Mean squares, because shares of different totals cannot be subtracted.
    before = verdict.baseline_rmse_nm[joint.name] ** 2
    remaining = verdict.extended_rmse_nm[joint.name] ** 2 if verdict.causes else 0.0

    def explained(one: Dependence) -> float:
        return one.share_before * before - one.share_after * remaining

    return max(ranking, key=explained).variable
