"""The tables a diagnosis writes: parameters of the extended model, residuals before and after, candidates."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import joints_of
from pipelines.diagnosis.fit import Fit
from pipelines.diagnosis.gain import scored
from pipelines.diagnosis.observations import Baseline, Run
from pipelines.diagnosis.uncertainty import Uncertainty
from pipelines.effects.rigid_body import RigidBody
from pipelines.estimation.parameter_table import Row, interval, table_of


def parameters(fit: Fit, baseline: Baseline, sure: Uncertainty) -> tuple[pd.DataFrame, NDArray]:
    """Return ``parameters/1`` of a fit, p rows, and their covariance (p, p).

    A rigid body for each kind of run, and the human's.
    """
    size, machine = len(sure.covariance), baseline.machine
    units = np.eye(size)
    values = np.append(fit.values, np.zeros(size - len(fit.values)))
    rows: list[Row] = []
    for run, bodies in _bodies(baseline).items():
        for i, p in enumerate(RigidBody(on=machine).linear):
            slope = units[[b * baseline.body + i for b in bodies]].sum(axis=0)
            rows.append(Row(RigidBody(run=run, on=machine), p, "inertia", float(slope @ values), slope))
    at = baseline.body * len(baseline.bodies)
    for effect in baseline.beside_bodies:
        places = np.arange(at, at + len(effect.linear))
        held = effect.completed(values[places])
        slopes = effect.jacobian(held)[:, : len(places)] @ units[places]
        step = "extension" if effect in baseline.known else "friction"
        fitted = zip(effect.parameters, effect.physical(held), slopes, strict=True)
        rows += [Row(effect, p, step, float(value), slope) for p, value, slope in fitted]
        at += len(effect.linear)
    onsets: dict[int, tuple[float, float]] = {}
    for number, cause in enumerate(fit.causes):
        first = fit.acting(cause)[0]
        onsets |= {len(rows) + at: ends for at, ends in _onsets(fit, sure, number, first).items()}
        of_first = zip(cause.effect.parameters, *_in_run(fit, sure, number, first), strict=True)
        rows += [Row(cause.effect, p, "extension", value, slope, p.typical[0] >= 0) for p, value, slope in of_first]
    T = np.array([row.slope for row in rows])
    covariance = T @ sure.covariance @ T.T
    frame = table_of(rows, np.sqrt(np.maximum(np.diag(covariance), 0.0)), sure.critical)
    for row, ends in onsets.items():
        frame.loc[row, ["ci95_low", "ci95_high"]] = ends
    return frame, covariance


def _onsets(fit: Fit, sure: Uncertainty, number: int, run: int) -> dict[int, tuple[float, float]]:
    """Return the ends of the interval of the instant at which a cause begins in a run, by its place among the cause's
    parameters; nothing where it has none."""
    linear = len(fit.causes[number].effect.linear)
    return {linear + i: ends for (which, i, r), ends in sure.onsets.items() if (which, r) == (number, run)}


def _bodies(baseline: Baseline) -> dict[str, list[int]]:
    if len(baseline.bodies) == 1:
        return {baseline.bodies[0]: [0]}
    return {"exo_alone": [0], "with_human": [0, 1], "human": [1]}


def _in_run(fit: Fit, sure: Uncertainty, number: int, run: int) -> tuple[NDArray, NDArray]:
    """Return a cause's parameters as files name them, (p,), in a run that it was fitted to and acts in.

    With them how each goes with what the covariance is of, (p, size).
    """
    cause = fit.causes[number]
    effect, places = cause.effect, fit.places(number, run)
    slopes = np.zeros((len(effect.fitted), len(sure.covariance)))
    slopes[np.arange(len(places)), places] = 1.0
    for order, (which, i, r) in enumerate(sure.shapes):
        if which == number and r in (-1, run):
            slopes[len(places) + i, len(fit.values) + order] = 1.0
    fitted = np.append(fit.values[places], cause.shapes[run])
    return effect.physical(fitted), effect.jacobian(fitted) @ slopes


def values_in_run(fit: Fit, sure: Uncertainty, number: int, run: int) -> tuple[NDArray, NDArray]:
    """Return a cause's parameters in a run that it was fitted to, (p,), and the ends of their intervals, (p, 2)."""
    values, slopes = _in_run(fit, sure, number, run)
    error = np.sqrt(np.maximum(np.einsum("pi,ij,pj->p", slopes, sure.covariance, slopes), 0.0))
    one_way = np.array([p.typical[0] >= 0 for p in fit.causes[number].effect.parameters])
    ends = interval(values, sure.critical * error, one_way)
    for at, own in _onsets(fit, sure, number, run).items():
        ends[at] = own
    return values, ends


def residual_rows(run: Run, residual: NDArray, model: str) -> pd.DataFrame:
    """Return a run's rows of ``residuals/1`` for what a model leaves of it, (m, O) N·m."""
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
    quantities: Mapping[str, NDArray] = {
        "angle": run.state[0], "velocity": run.state[1], "acceleration": run.state[2], "torque": run.measured[:, :J],
        "predicted": run.measured[:, :J] - residual[:, :J], "residual": residual[:, :J],
    }  # fmt: skip
    for j, joint in enumerate(joints):
        columns |= {joint.column(name): values[:, j] for name, values in quantities.items()}
    return pd.DataFrame(columns)


def residual_table(runs: Sequence[Run], by_model: Mapping[str, Sequence[NDArray]]) -> pd.DataFrame:
    """Return ``residuals/1`` of several runs under several models, each residual (m, O) N·m."""
    return pd.concat(
        [
            residual_rows(run, residual, model)
            for model, residuals in by_model.items()
            for run, residual in zip(runs, residuals, strict=True)
        ],
        ignore_index=True,
    )
