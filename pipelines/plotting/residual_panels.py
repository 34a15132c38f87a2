"""Panels of a ``residuals/1`` table: torque over time, and residuals against any of its columns."""

from collections.abc import Sequence
from math import ceil

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import Joint
from pipelines.plotting.chart import DrawnTable, Mark, Panel, Role, Series
from pipelines.signals.binned_mean import binned_mean


def torque_panels(
    joint: Joint, measured: pd.DataFrame, models: Sequence[DrawnTable], floor: float | None = None
) -> tuple[Panel, Panel]:
    """Return a joint's torque over time, measured and predicted, and the residuals.

    Parameters
    ----------
    joint : Joint
    measured : DataFrame
        The n rows of one model in one run.
    models : sequence of DrawnTable
        The rows of each drawn model; one with other rows is left out.
    floor : float, optional
        Noise floor, N·m or N, drawn as a band.
    """
    quantity, unit = joint.effort, joint.unit("torque")
    torques, errors = [], []
    for model in models:
        rows = model.rows
        # A model with other rows cannot share the chart's time.
        if len(rows) != len(measured):
            continue
        torques.append(Series(model.words, rows[joint.column("predicted")].to_numpy(), model.role))
        # NaN interrupts the line at reversals, which the error does not count.
        residual = rows[joint.column("residual")].where(rows["scored"]).to_numpy()
        errors.append(Series(model.words, residual, model.role))
    torques.append(Series("measured", measured[joint.column("torque")].to_numpy(), Role.MEASURED))
    return (
        Panel(f"{quantity}, {unit}", tuple(torques)),
        Panel(f"error, {unit}", tuple(errors), band=floor),
    )


def residual_panel(
    joint: Joint,
    column: str,
    models: Sequence[DrawnTable],
    reach: float | None,
    floor: float | None = None,
) -> tuple[NDArray, Panel]:
    """Return dots and running means of a joint's residuals along a column of the table.

    All models share the column's values, because the motion is the same.

    Parameters
    ----------
    joint : Joint
    column : str
        The column that residuals are drawn against.
    models : sequence of DrawnTable
        Scored rows of each model.
    reach : float or None
        Half the height of the panel, N·m or N.
    floor : float, optional
        Noise floor, N·m or N, drawn as a band.

    Returns
    -------
    x : (n,) array
        Values of the column, not decreasing.
    Panel
        Series of n values each.
    """
    models = [model for model in models if len(model.rows)]
    x = models[0].rows[column].to_numpy() if models else np.zeros(0)
    # The columns of a chart share x. Dots and means are therefore rows of one table, each with NaN
    # where the other has its places.
    step = max(1, ceil(len(x) / 2500))  # more dots would hide the shape of the cloud
    middles = _mean_along(x, x)[0] if len(x) else x
    places = np.concatenate([x[::step], middles])
    order = np.argsort(places, kind="stable")
    clouds, means = [], []
    for model in models:
        y = model.rows[joint.column("residual")].to_numpy()
        # A model with other rows cannot share x.
        if len(y) != len(x):
            continue
        dots, line = np.full((2, len(places)), np.nan)
        dots[: len(places) - len(middles)] = y[::step]
        line[len(places) - len(middles) :] = _mean_along(x, y)[1]
        clouds.append(Series("", dots[order], model.role, Mark.DOTS))
        means.append(Series(model.words, line[order], model.role, Mark.MEAN))
    label = f"{joint.name} {joint.effort} error, {joint.unit('torque')}"
    return places[order], Panel(label, (*clouds, *means), floor, reach)


def residual_reach(scored: pd.DataFrame, joint: Joint) -> float | None:
    """Return half the height of a panel of a joint's residuals; None where none is scored."""
    size = np.abs(scored[joint.column("residual")].to_numpy())
    # A percentile with a margin, so that a few outliers do not flatten the cloud.
    return 1.1 * float(np.percentile(size, 99.5)) if len(size) else None


def _mean_along(x: NDArray, y: NDArray) -> tuple[NDArray, NDArray]:
    """Return a running mean of y (n,) along x (n,): places and means, (k,) each."""
    # The outermost bins would hold too few points for a mean.
    low, high = np.percentile(x, [0.5, 99.5])
    return binned_mean(x, y, low, high + 1e-12)
