"""The two-step fit, by whatever estimator.

Step 1 fits the rigid body and the friction of the empty exoskeleton. Step 2 holds that friction and
fits the rigid body of human and exoskeleton; step 1's covariance is carried into step 2's intervals.
A fit of everything at once is computed beside it as a check. Least squares goes through each training run once to
compress its rows, from which every fit follows, and twice for the covariance of what the fit left.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.effects import Effect, Parameter
from pipelines.estimation.angle_noise import CUTOFF_HZ, IN_WORDS, is_loud
from pipelines.estimation.collinearity import collinearities
from pipelines.estimation.estimator import Estimate, Estimator, estimated
from pipelines.estimation.least_squares import WeightedLeastSquares
from pipelines.estimation.problem import Problem, Training
from pipelines.identification.runs import Runs, checked
from pipelines.identification.validation import Validation, validate
from pipelines.mechanics.run import Run
from pipelines.mechanics.scale import on_one_scale
from pipelines.model import Model, Term, baseline, unrealizable, upside_down

BIASED = (
    f"{IN_WORDS}, which lets every fit take the machine for too light; set filter.cutoff_hz = {CUTOFF_HZ:g}, and see "
    "to encoder counts and time stamps"
)


@dataclass(frozen=True)
class Row:
    """One row of ``parameters/1`` before it has a value."""

    effect: Effect
    parameter: Parameter
    run: str | None
    step: str


@dataclass(frozen=True)
class Identified:
    """What an identification found and how far to trust it."""

    parameters: pd.DataFrame
    """``parameters/1``."""
    covariance: NDArray
    """In the order of ``parameters``."""
    one_step: NDArray
    """The values of a fit of everything at once, in the same order."""
    validation: Validation
    models: dict[str, Model]
    """What was found, for each kind of run."""
    collinear: list[str]
    """What this motion cannot separate, a sentence each."""
    unrealizable: list[str]
    """Which rigid bodies, and which friction, no real leg could have, a sentence each."""
    method: dict[str, Any]
    """How it was found, for the file's metadata."""
    remarks: list[str]
    """What the method says of these data, and of a machine that would stand on its head, a sentence each."""
    angle_noise: list[str]
    """A sentence where noise of the angles biases every fit; empty where it does not."""


def identify(motions: Sequence[Run], estimator: Estimator | None = None) -> Identified:
    """Identify friction, the exoskeleton's rigid body and, where there are runs with one, the human's.

    Parameters
    ----------
    motions : sequence of Run
        Runs to train on and to validate on.
    estimator : Estimator, optional
        The method of both steps; weighted least squares unless given.

    Raises
    ------
    InputError
        Where runs are missing, do not belong together or lack what the method needs.
    NotIdentifiable
        Where the motion cannot separate the parameters.
    """
    estimator = estimator or WeightedLeastSquares()
    runs = checked(on_one_scale(motions))
    model = _model(runs)
    columns = model.linear_parameters
    training = Training(tuple(runs.of("train")), model)
    nothing = np.zeros(len(columns))
    friction = _columns(model, None)
    first = Problem(training, ("exo_alone",), np.append(_columns(model, "exo_alone"), friction), nothing)
    fits = {"exo_alone": estimated(estimator.fit(first))}
    alone = fits["exo_alone"]
    rows = [Row(effect, parameter, effect.run, "friction") for effect, parameter in (columns[c] for c in first.fitted)]
    values, covariance = alone.values, alone.covariance
    critical = np.full(len(rows), alone.critical)
    problems = {"exo_alone": first}
    if "with_human" in runs.kinds:
        second = Problem(training, ("with_human",), _columns(model, "with_human"), first.completed(alone.values))
        held = fits["with_human"] = estimated(estimator.fit(second))
        problems["with_human"] = second
        values, covariance = _joined(alone, held, first)
        body = [columns[column] for column in second.fitted]
        rows += [Row(e, p, "with_human", "inertia") for e, p in body]
        rows += [Row(e, p, "human", "inertia") for e, p in body]
        # Each fit's intervals by its own lag; a difference of both fits is no surer than the less sure of them.
        own, either = held.critical, max(alone.critical, held.critical)
        critical = np.concatenate([critical, np.repeat([own, either], len(body))])
    table = _table(rows, values, covariance, critical)
    final = {kind: _of_run(model.for_run(kind), table, kind) for kind in runs.kinds}
    return Identified(
        parameters=table,
        covariance=covariance,
        one_step=_one_step(Problem(training, runs.kinds, np.arange(len(columns)), nothing), estimator, rows),
        validation=validate(runs.of("validate"), final),
        models=final,
        collinear=[
            f"{kind}: {s}" for kind, fit in fits.items() for s in collinearities(fit.normal, problems[kind].names)
        ],
        unrealizable=_unrealizable(table, runs),
        method=_method(estimator, fits),
        remarks=[
            *(f"{kind}: {remark}" for kind, fit in fits.items() for remark in fit.remarks),
            *upside_down(table, runs.motions[0].machine),
        ],
        angle_noise=[BIASED] * is_loud(training.runs),
    )


def _model(runs: Runs) -> Model:
    effects = baseline(runs.motions[0].machine, runs.kinds)
    return Model(tuple(Term(effect, np.zeros(len(effect.linear))) for effect in effects))


def _columns(model: Model, kind: str | None) -> NDArray:
    """Return the columns of what is there in one kind of run alone, or, for None, in all."""
    return np.flatnonzero([effect.run == kind for effect, _ in model.linear_parameters])


def _method(estimator: Estimator, fits: Mapping[str, Estimate]) -> dict[str, Any]:
    return {
        "name": f"two-step {estimator.title}",
        "estimator": estimator.name,
        "covariance": "sandwich with Bartlett-weighted long-run scores, Andrews' lag",
        "interval": "95 %, critical value after Kiefer and Vogelsang",
        "steps": {kind: fit.told for kind, fit in fits.items()},
    }


def _joined(alone: Estimate, second: Estimate, first: Problem) -> tuple[NDArray, NDArray]:
    """Stack (step 1, with_human, human) and propagate step 1's covariance into the rest."""
    p, b = len(alone.values), len(second.values)
    to_body = second.carry[:, first.fitted]
    covariance = np.zeros((p + b, p + b))
    covariance[:p, :p] = alone.covariance
    covariance[p:, :p] = to_body @ alone.covariance
    covariance[:p, p:] = covariance[p:, :p].T
    covariance[p:, p:] = second.covariance + to_body @ alone.covariance @ to_body.T
    # The human is with_human less exo_alone.
    human = np.hstack([-np.eye(b, p), np.eye(b)])
    stack = np.vstack([np.eye(p + b), human])
    values = np.concatenate([alone.values, second.values])
    return stack @ values, stack @ covariance @ stack.T


def _table(rows: Sequence[Row], values: NDArray, covariance: NDArray, critical: NDArray) -> pd.DataFrame:
    error = np.sqrt(np.diag(covariance))
    return pd.DataFrame(
        {
            "name": [row.parameter.name for row in rows],
            "symbol": [row.parameter.symbol for row in rows],
            "joint": [row.effect.joint for row in rows],
            "run": [row.run for row in rows],
            "value": values,
            "unit": [row.parameter.unit for row in rows],
            "std_error": error,
            "ci95_low": values - critical * error,
            "ci95_high": values + critical * error,
            "step": [row.step for row in rows],
            "effect": [row.effect.name for row in rows],
        }
    )


def _of_run(model: Model, table: pd.DataFrame, kind: str) -> Model:
    """Fill a model with the values that hold for a kind of run: its rigid body, then the shared friction."""
    body = table[(table["effect"] == "rigid_body") & (table["run"] == kind)]
    friction = table[table["effect"] == "friction"]
    return model.with_linear(np.concatenate([body["value"], friction["value"]]))


def _one_step(problem: Problem, estimator: Estimator, rows: Sequence[Row]) -> NDArray:
    """Fit all runs at once, friction shared, and return the values in the order of ``rows``."""
    found = {
        (effect.name, effect.joint, parameter.name, effect.run): value
        for (effect, parameter), value in zip(
            problem.model.linear_parameters, estimator.fit(problem).values, strict=True
        )
    }

    def of_run(row: Row, run: str | None) -> float:
        return found[row.effect.name, row.effect.joint, row.parameter.name, run]

    return np.array(
        [
            of_run(row, "with_human") - of_run(row, "exo_alone") if row.run == "human" else of_run(row, row.run)
            for row in rows
        ]
    )


def _unrealizable(table: pd.DataFrame, runs: Runs) -> list[str]:
    driving = table[(table["effect"] == "friction") & (table["ci95_high"] < 0.0)]
    return unrealizable(table, runs.motions[0].machine, runs.motions[0].geometry) + [
        f"{row['name']} friction of {row['joint']} is {row['value']:.3g} {row['unit']} ({row['ci95_low']:.3g} to "
        f"{row['ci95_high']:.3g}) and would drive the joint; look for a wrong sign of its torque or its angle, or for "
        "what is taken for friction (exoid diagnose)"
        for row in driving.to_dict("records")
    ]
