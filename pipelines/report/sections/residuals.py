"""What each model leaves of the torque, against what the residuals' table knows: angle, speed, load
and time."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts import Joint
from pipelines.report.charts.chart import Chart, Mark, Panel, Series
from pipelines.report.sections.fit_quality import MODELS, models_of
from pipelines.report.session import Session
from pipelines.signals.binned_mean import FEWEST, binned_mean

DOTS = 2500
"""At most, or a cloud hides its shape."""
TALLEST = 99.5
"""Percentile of the residual's size that a panel must show."""
DEPENDENCES = {
    "angle": "angle",
    "velocity": "speed",
    "acceleration": "acceleration",
    "torque": "load",
}
"""Columns of the residuals' table, and the variables of the verdict's ``depends_on`` that they
are."""


@dataclass(frozen=True)
class Against:
    """One column that residuals are drawn against."""

    variable: str
    """As the verdict's ``depends_on`` calls it."""
    title: str
    label: str
    column: str


def against(session: Session, joint: Joint) -> list[Against]:
    """Return what a joint's residuals can be drawn against; the other joint's motion too where
    there is one."""
    charts = [_along(joint, quantity, variable) for quantity, variable in DEPENDENCES.items()]
    for other in session.joints:
        if other != joint and len(session.joints) == 2:
            charts += [
                _along(other, quantity, f"other_{variable}")
                for quantity, variable in DEPENDENCES.items()
                if variable != "acceleration"
            ]
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
    judged = frame[frame["scored"] & (frame["purpose"] == "validate")]
    for joint in session.joints:
        reach = _reach(judged, joint)
        for one in against(session, joint):
            yield _chart(session, judged, joint, one, reach)


def _reach(frame: pd.DataFrame, joint: Joint) -> float | None:
    size = np.abs(frame[joint.column("residual")].to_numpy())
    return 1.1 * float(np.percentile(size, TALLEST)) if len(size) else None


def _chart(
    session: Session, frame: pd.DataFrame, joint: Joint, one: Against, reach: float | None
) -> Chart:
    """Return dots and running means; every model has its dots at the same places, for they are
    those of the motion."""
    rows = {model: frame[frame["model"] == model] for model in models_of(session)}
    rows = {model: table for model, table in rows.items() if len(table)}
    x = next(iter(rows.values()))[one.column].to_numpy() if rows else np.zeros(0)
    step = max(1, len(x) // DOTS)
    middles = _mean_along(x, x)[0] if len(x) else x
    places = np.concatenate([x[::step], middles])
    order = np.argsort(places, kind="stable")
    clouds, means = [], []
    for model, table in rows.items():
        role, words = MODELS[model]
        y = table[joint.column("residual")].to_numpy()
        if len(y) != len(x):
            continue
        dots, line = np.full((2, len(places)), np.nan)
        dots[: len(places) - len(middles)] = y[::step]
        line[len(places) - len(middles) :] = _mean_along(x, y)[1]
        clouds.append(Series("", dots[order], role, Mark.DOTS))
        means.append(Series(words, line[order], role, Mark.MEAN))
    quantity = joint.effort
    floor = (session.verdict or {}).get("noise_floor_nm", {}).get(joint.name)
    return Chart(
        key=f"residual-{joint.name}-{one.variable.replace('_', '-')}",
        title=f"{joint.name} error against {one.title}",
        caption=(
            "Dots are blocks of validation runs away from reversals, lines their running means,"
            f" each of {FEWEST} blocks or more; the band is the noise floor."
        ),
        x_label=one.label,
        x=places[order],
        panels=(
            Panel(
                f"{joint.name} {quantity} error, {joint.unit('torque')}",
                (*clouds, *means),
                floor,
                reach,
            ),
        ),
    )


def _mean_along(x: NDArray, y: NDArray) -> tuple[NDArray, NDArray]:
    """Return a running mean of y (n,) along x (n,): places and means, (k,) each.

    The bins span all but the outermost 0.5 % at either end, where a mean would be of hardly any.
    """
    low, high = np.percentile(x, [0.5, 99.5])
    return binned_mean(x, y, low, high + 1e-12)


def telling(session: Session, joint: Joint) -> str:
    """Return the variable that foretold most of what naming the causes took away; of all there is,
    where none is named.

    Shares are of the variance that each model leaves, so they count by its mean square.
    """
    verdict = session.verdict or {}
    known = {one.variable for one in against(session, joint)}
    ranking = [
        one for one in verdict.get("depends_on", {}).get(joint.name, []) if one["variable"] in known
    ]
    if not ranking:
        return "angle"
    before, after = (
        verdict[f"{model}_rmse_nm"][joint.name] ** 2 for model in ("baseline", "extended")
    )
    taken = after if verdict["causes"] else 0.0
    return max(ranking, key=lambda one: one["share_before"] * before - one["share_after"] * taken)[
        "variable"
    ]
