"""Build the tables of a diagnosis: parameters of the extended model, and residuals."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import joints_of
from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.joint_fit import Fit
from pipelines.diagnosis.fit.uncertainty import Uncertainty
from pipelines.diagnosis.fit.validation_error import scored
from pipelines.effects import RUNS
from pipelines.effects.baseline import ForceSensorZero, RigidBody
from pipelines.estimation.parameter_table import Row, interval, rows_of, table_of
from pipelines.estimation.sandwich import sandwich


def parameters(fit: Fit, baseline: Baseline, sure: Uncertainty) -> tuple[pd.DataFrame, NDArray]:
    """Return ``parameters/1`` of a fit, and the covariance of its rows.

    There is a rigid body for each kind of run, and the human's. Inertial parameters that nothing
    determines are left out.

    Parameters
    ----------
    fit : Fit
    baseline : Baseline
    sure : Uncertainty
        Of the fit.

    Returns
    -------
    DataFrame
        p rows.
    (p, p) array
        Covariance.
    """
    # The covariance has places for shapes and onsets too, which have no linear value.
    units = np.eye(len(sure.covariance))
    values = np.append(fit.values, np.zeros(len(units) - len(fit.values)))
    rows: list[Row] = []
    # Their columns are zero at every output that was measured.
    unknown = np.flatnonzero(np.diag(sure.normal) == 0.0)
    for run, bodies in _bodies(baseline).items():
        slopes = units[bodies].sum(axis=0)
        body = RigidBody(run=run, on=baseline.machine)
        of_body = rows_of(body, slopes @ values, slopes, "inertia")
        rows += [row for row in of_body if not row.slope[unknown].any()]
    for term in baseline.layout.terms:
        if not isinstance(term.effect, (RigidBody, ForceSensorZero)):
            step = "extension" if term.effect in baseline.known else "friction"
            fitted = term.effect.completed(values[term.slice])
            rows += rows_of(term.effect, fitted, units[term.slice], step)
    onsets: dict[int, tuple[float, float]] = {}
    for number in range(len(fit.causes)):
        # The table has one value of each parameter: that of the first run with the cause.
        first = fit.columns_of(number).runs[0]
        onsets |= {len(rows) + at: ends for at, ends in _onsets(fit, sure, number, first).items()}
        effect = fit.causes[number].effect
        fitted, slopes = _in_run(fit, sure, number, first)
        rows += rows_of(effect, fitted, slopes, "extension", positive=effect.parameters)
    covariance = sandwich(np.array([row.slope for row in rows]), sure.covariance)
    frame = table_of(rows, np.sqrt(np.maximum(np.diag(covariance), 0.0)), sure.critical)
    # An onset is not Gaussian, so its own interval replaces that of its variance.
    for row, ends in onsets.items():
        frame.loc[row, ["ci95_low", "ci95_high"]] = ends
    return frame, covariance


def _onsets(fit: Fit, sure: Uncertainty, number: int, run: int) -> dict[int, tuple[float, float]]:
    """Return the interval of a cause's onset in a run, by its place among the parameters.

    The result is empty for a cause without an onset.
    """
    linear = len(fit.causes[number].effect.linear)
    return {
        linear + i: ends
        for (which, i, r), ends in sure.onsets.items()
        if (which, r) == (number, run)
    }


def _bodies(baseline: Baseline) -> dict[str, NDArray]:
    """Return the columns of the rigid bodies, (bodies, parameters).

    A row of the table, of one kind of run, is the sum of these columns.
    """
    layout = baseline.layout
    if len(layout.bodies) == 1:
        return {baseline.kinds[0]: layout.bodies_in(baseline.kinds[0])}
    every = {kind: layout.bodies_in(kind) for kind in RUNS}
    return {**every, "human": every["with_human"][1:]}


def _in_run(fit: Fit, sure: Uncertainty, number: int, run: int) -> tuple[NDArray, NDArray]:
    """Return a cause's fitted values in a run that it acts in, (p,), and their slopes.

    The slopes, (p, size), are derivatives by the parameters of the covariance.
    """
    cause, columns = fit.causes[number], fit.columns_of(number)
    linear = len(cause.effect.linear)
    slopes = np.zeros((len(cause.effect.fitted), len(sure.covariance)))
    # Each value is one of the covariance's parameters, so its slope is a unit vector.
    slopes[np.arange(linear), columns.places(run)] = 1.0
    for order, (which, i, r) in enumerate(sure.shapes):
        if which == number and r in (-1, run):
            slopes[linear + i, len(fit.values) + order] = 1.0
    fitted = columns.select(fit.values, run, np.zeros(linear))
    return np.append(fitted, cause.shapes[run]), slopes


def values_in_run(fit: Fit, sure: Uncertainty, number: int, run: int) -> tuple[NDArray, NDArray]:
    """Return a cause's parameters in a run, and the ends of their intervals.

    Parameters
    ----------
    fit : Fit
    sure : Uncertainty
        Of the fit.
    number, run : int
        Numbers of the cause and of a run that it acts in.

    Returns
    -------
    (p,) array
        Values.
    (p, 2) array
        Ends of the 95 % intervals.
    """
    effect = fit.causes[number].effect
    fitted, fitted_slopes = _in_run(fit, sure, number, run)
    values, slopes = effect.physical(fitted), effect.jacobian(fitted) @ fitted_slopes
    error = np.sqrt(np.maximum(np.einsum("pi,ij,pj->p", slopes, sure.covariance, slopes), 0.0))
    one_way = np.array([p.typical[0] >= 0 for p in effect.parameters])
    ends = interval(values, sure.critical * error, one_way)
    for at, own in _onsets(fit, sure, number, run).items():
        ends[at] = own
    return values, ends


def _residual_rows(run: Run, residual: NDArray, model: str) -> pd.DataFrame:
    """Return a run's rows of ``residuals/1`` for a model's residual, (m, O) N·m."""
    joints = joints_of(run.motion.metadata)
    J = len(joints)
    columns: dict[str, Any] = {
        "file": np.full(len(run.time), run.motion.file),
        "run": run.motion.run,
        "purpose": run.motion.purpose,
        "segment": run.motion.segment[run.starts],
        "time_s": run.time,
        "model": model,
        "scored": scored(run),
    }
    torque = np.where(run.motion.machine.measured, run.measured[:, :J], np.nan)
    quantities: Mapping[str, NDArray] = {
        "angle": run.state[0],
        "velocity": run.state[1],
        "acceleration": run.state[2],
        "torque": torque,
        "predicted": torque - residual[:, :J],
        "residual": np.where(run.motion.machine.measured, residual[:, :J], np.nan),
    }
    for j, joint in enumerate(joints):
        columns |= {joint.column(name): values[:, j] for name, values in quantities.items()}
    return pd.DataFrame(columns)


def residual_table(runs: Sequence[Run], by_model: Mapping[str, Sequence[NDArray]]) -> pd.DataFrame:
    """Return ``residuals/1`` of several runs under several models.

    Parameters
    ----------
    runs : sequence of Run
        m blocks each.
    by_model : mapping
        By name of the model: a residual (m, O) of each run, N·m.
    """
    return pd.concat(
        [
            _residual_rows(run, residual, model)
            for model, residuals in by_model.items()
            for run, residual in zip(runs, residuals, strict=True)
        ],
        ignore_index=True,
    )
