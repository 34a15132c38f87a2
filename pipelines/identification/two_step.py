"""The two-step fit.

Step 1 fits the rigid body and the friction of the empty exoskeleton. Step 2 holds that friction and
fits the rigid body of human and exoskeleton; step 1's covariance is carried into step 2's intervals.
A fit of everything at once is computed beside it as a check. Each training run is gone through once to compress its
rows, from which every fit follows, and twice for the covariance of what the fit left.
"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.effects import Effect, Parameter
from pipelines.estimation.collinearity import collinearities
from pipelines.estimation.least_squares import (
    Compressed,
    Estimate,
    Fit,
    compress,
    estimate,
    normal_equations,
    score,
    solve,
    together,
)
from pipelines.estimation.long_run import Scores
from pipelines.estimation.regression import regressions
from pipelines.identification.runs import Runs, checked
from pipelines.identification.validation import Validation, validate
from pipelines.mechanics.run import Run
from pipelines.model import Model, Term, baseline

METHOD = {
    "name": "two-step weighted least squares",
    "covariance": "sandwich with Bartlett-weighted long-run scores, Andrews' lag",
    "interval": "95 %, critical value after Kiefer and Vogelsang",
}


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
    """Which rigid bodies no real leg could have, a sentence each."""


def identify(motions: Sequence[Run]) -> Identified:
    """Identify friction, the exoskeleton's rigid body and, where there are runs with one, the human's.

    Raises
    ------
    InputError
        Where runs are missing or do not belong together.
    NotIdentifiable
        Where the motion cannot separate the parameters.
    """
    runs = checked(motions)
    models = {kind: _model(runs, (kind,)) for kind in runs.kinds}
    train = {kind: _compressed(runs, kind, models[kind]) for kind in runs.kinds}
    alone = _alone(runs, train["exo_alone"], models["exo_alone"])
    rows = [Row(e, p, e.run, "friction") for e, p in models["exo_alone"].linear_parameters]
    values, covariance = alone.values, alone.covariance
    critical = np.full(len(rows), alone.critical)
    collinear = [f"exo_alone: {s}" for s in _collinear(train["exo_alone"], alone, models["exo_alone"])]
    if "with_human" in runs.kinds:
        second = _with_friction_held(runs, train["with_human"], alone, models["with_human"])
        values, covariance = _joined(alone, second)
        body = [(e, p) for e, p in models["with_human"].linear_parameters if e.name == "rigid_body"]
        rows += [Row(e, p, "with_human", "inertia") for e, p in body]
        rows += [Row(e, p, "human", "inertia") for e, p in body]
        # Each fit's intervals by its own lag; a difference of both fits is no surer than the less sure of them.
        own, either = second.estimate.critical, max(alone.critical, second.estimate.critical)
        critical = np.concatenate([critical, np.repeat([own, either], len(body))])
        collinear += [f"with_human: {s}" for s in second.collinear]
    table = _table(rows, values, covariance, critical)
    final = {kind: _of_run(models[kind], table, kind) for kind in runs.kinds}
    return Identified(
        parameters=table,
        covariance=covariance,
        one_step=_one_step(runs, train, models, rows),
        validation=validate(runs.of("validate"), final),
        models=final,
        collinear=collinear,
        unrealizable=_unrealizable(table, runs),
    )


def _model(runs: Runs, kinds: Sequence[str]) -> Model:
    effects = baseline(runs.motions[0].machine, kinds)
    return Model(tuple(Term(effect, np.zeros(len(effect.linear))) for effect in effects))


def _names(model: Model) -> list[str]:
    return [_name(effect, parameter) for effect, parameter in model.linear_parameters]


def _name(effect: Effect, parameter: Parameter) -> str:
    return f"{effect.joint} {parameter.name}" if effect.joint else parameter.name


def _compressed(runs: Runs, kind: str, model: Model) -> Compressed:
    return compress(r for run in runs.of("train", kind) for r in regressions(run, model))


def _scores(runs: Runs, kind: str, model: Model, values: NDArray, weights: NDArray, columns: NDArray) -> Scores:
    """Return the scores of the fitted ``columns`` of a model whose columns all have ``values``."""

    def go_through() -> Iterator[tuple[Hashable, NDArray]]:
        for number, run in enumerate(runs.of("train", kind)):
            for r in regressions(run, model):
                for segment, scores in score(r, values, weights, columns):
                    yield (number, segment), scores

    return go_through


def _alone(runs: Runs, rows: Compressed, model: Model) -> Estimate:
    """Fit the rigid body and the friction of the empty exoskeleton."""
    fit = solve(rows, _names(model))
    every = np.arange(len(fit.values))
    return estimate(fit, _scores(runs, "exo_alone", model, fit.values, fit.weights, every))


def _collinear(rows: Compressed, fit: Fit, model: Model) -> list[str]:
    return collinearities(normal_equations(rows, fit.weights)[0], _names(model))


@dataclass(frozen=True)
class _Second:
    estimate: Estimate
    carry: NDArray
    """(body, friction) how the rigid body answers to the friction that was held."""
    collinear: list[str]


def _with_friction_held(runs: Runs, rows: Compressed, alone: Estimate, model: Model) -> _Second:
    """Fit the rigid body of human and exoskeleton under step 1's friction."""
    is_body = np.array([effect.name == "rigid_body" for effect, _ in model.linear_parameters])
    body, friction = np.flatnonzero(is_body), np.flatnonzero(~is_body)
    names = [name for name, chosen in zip(_names(model), is_body, strict=True) if chosen]
    fit = solve(rows.with_held(friction, alone.values[friction]).select(body), names)
    values = alone.values.copy()
    values[body] = fit.values
    found = estimate(fit, _scores(runs, "with_human", model, values, fit.weights, body))
    gram, _ = normal_equations(rows, fit.weights)
    carry = -fit.sensitivity @ gram[np.ix_(body, friction)]
    return _Second(found, carry, collinearities(gram[np.ix_(body, body)], names))


def _joined(alone: Estimate, second: _Second) -> tuple[NDArray, NDArray]:
    """Stack (step 1, with_human, human) and propagate step 1's covariance into the rest."""
    p, b = len(alone.values), len(second.estimate.values)
    friction = np.arange(b, p)
    to_body = np.zeros((b, p))
    to_body[:, friction] = second.carry
    covariance = np.zeros((p + b, p + b))
    covariance[:p, :p] = alone.covariance
    covariance[p:, :p] = to_body @ alone.covariance
    covariance[:p, p:] = covariance[p:, :p].T
    covariance[p:, p:] = second.estimate.covariance + to_body @ alone.covariance @ to_body.T
    # The human is with_human less exo_alone.
    human = np.hstack([-np.eye(b, p), np.eye(b)])
    stack = np.vstack([np.eye(p + b), human])
    values = np.concatenate([alone.values, second.estimate.values])
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


def _one_step(runs: Runs, train: Mapping[str, Compressed], models: Mapping[str, Model], rows: Sequence[Row]) -> NDArray:
    """Fit all runs at once, friction shared, and return the values in the order of ``rows``."""
    model = _model(runs, runs.kinds)
    columns = {parameter: column for column, parameter in enumerate(model.linear_parameters)}
    own = {kind: np.array([columns[parameter] for parameter in models[kind].linear_parameters]) for kind in train}
    fit = solve(together([train[kind].spread(own[kind], len(columns)) for kind in train]), _names(model))
    found = {
        (effect.name, effect.joint, parameter.name, effect.run): value
        for (effect, parameter), value in zip(model.linear_parameters, fit.values, strict=True)
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
    bodies = table[table["effect"] == "rigid_body"]
    mechanism, geometry = runs.motions[0].machine.mechanism, runs.motions[0].geometry
    sentences = []
    for run in bodies["run"].unique():
        X = bodies.loc[bodies["run"] == run, "value"].to_numpy(float)
        sentences += [f"{run}: {reason}" for reason in mechanism.unrealizable(X, geometry)]
    return sentences
