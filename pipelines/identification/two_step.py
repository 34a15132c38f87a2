"""The two-step fit, by whatever estimator.

Step 1 fits the rigid body and the friction of the empty exoskeleton. Step 2 holds that friction and
fits the rigid body of human and exoskeleton; step 1's covariance is carried into step 2's intervals.
What the model has beside both is fitted in step 1, or in step 2 where it acts with a human only.
A fit of everything at once is computed beside it as a check. Least squares goes through each training run once to
compress its rows, from which every fit follows, and twice for the covariance of what the fit left.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.effects.rigid_body import RigidBody
from pipelines.estimation.angle_noise import CUTOFF_HZ, IN_WORDS, is_loud
from pipelines.estimation.collinearity import collinearities
from pipelines.estimation.estimator import Estimate, Estimator, Fit, estimated
from pipelines.estimation.least_squares import WeightedLeastSquares
from pipelines.estimation.problem import Problem, Training
from pipelines.estimation.regression import mask_in_words
from pipelines.identification.extension import Extension
from pipelines.identification.parameter_rows import Row, rows, table_of
from pipelines.identification.runs import Runs, checked
from pipelines.identification.validation import Validation, validate
from pipelines.mechanics.run import Run
from pipelines.mechanics.scale import on_one_scale
from pipelines.model import Model, Term, baseline, unrealizable, upside_down

BIASED = (
    f"{IN_WORDS}, which lets every fit take the machine for too light; set filter.cutoff_hz = {CUTOFF_HZ:g}, and see "
    "to encoder counts and time stamps"
)
STEP = 0.25
"""Standard errors by which a shape is moved to see what the values make of it."""

Found = TypeVar("Found", bound=Fit, covariant=True)


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
    runs: tuple[Run, ...]
    """As they were fitted and judged."""
    training: Training
    values: NDArray
    """(p,) of the training's model."""
    extension: Extension
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

    def model_of(self, run: Run) -> Model | None:
        """Return what was found, as it is in a run; None where none of its kind was trained on."""
        return _found(self.training, self.values, run)

    @property
    def models(self) -> dict[str, Model]:
        """What was found, for each kind of run; what each run has for itself is as in the first trained on."""
        first = {run.run: run for run in reversed(self.training.runs)}
        return {kind: self.training.model_of(run, self.values).for_run(kind) for kind, run in first.items()}


def identify(
    motions: Sequence[Run],
    estimator: Estimator | None = None,
    extension: Extension | None = None,
    *,
    reversals: bool = False,
) -> Identified:
    """Identify friction, the exoskeleton's rigid body and, where there are runs with one, the human's.

    Parameters
    ----------
    motions : sequence of Run
        Runs to train on and to validate on.
    estimator : Estimator, optional
        The method of both steps; weighted least squares unless given.
    extension : Extension, optional
        What the model has beside rigid body and friction. Whole runs are then held in memory, for it may remember.
    reversals : bool
        Whether samples near reversals are fitted, too.

    Raises
    ------
    InputError
        Where runs are missing, do not belong together or lack what the method needs.
    NotIdentifiable
        Where the motion cannot separate the parameters.
    """
    estimator, extension = estimator or WeightedLeastSquares(), extension or Extension()
    runs = checked(on_one_scale(motions))
    if extension.effects:
        runs = Runs(tuple(run.whole() for run in runs.motions))
    model = _model(runs, extension.checked(runs.kinds))
    training = Training(tuple(runs.of("train")), model, extension.own, reversals)
    steps = {kind: Step(one.problem, estimated(one.fit)) for kind, one in _in_steps(training, estimator, runs).items()}
    values = _values(steps)
    told = list(rows(model, extension, values))
    covariance = _covariance(told, steps, extension, _answer_to_shapes(training, extension, runs))
    table = table_of(told, covariance, _critical(told, steps))
    everything = Problem(training, runs.kinds, np.arange(len(values)), np.zeros(len(values)))
    return Identified(
        parameters=table,
        covariance=covariance,
        one_step=np.array([row.value for row in rows(model, extension, estimator.fit(everything).values)]),
        validation=validate(runs.of("validate"), lambda run: _found(training, values, run)),
        runs=runs.motions,
        training=training,
        values=values,
        extension=extension,
        collinear=[
            f"{kind}: {sentence}"
            for kind, step in steps.items()
            for sentence in collinearities(step.fit.normal, step.problem.names)
        ],
        unrealizable=_unrealizable(table, runs),
        method=_method(estimator, steps, training),
        remarks=[
            *(f"{kind}: {remark}" for kind, step in steps.items() for remark in step.fit.remarks),
            *upside_down(table, runs.motions[0].machine),
            *extension.remarks,
        ],
        angle_noise=[BIASED] * is_loud(training.runs),
    )


def _model(runs: Runs, extension: Extension) -> Model:
    machine = runs.motions[0].machine
    effects = baseline(machine, runs.kinds)
    if "with_human" in runs.kinds and any(effect.at_cuff for effect in extension.effects):
        # Machine and limb move apart: each needs its own body.
        effects = (RigidBody(on=machine), RigidBody(run="with_human", on=machine), *effects[2:])
    return Model((*(Term(effect, np.zeros(len(effect.linear))) for effect in effects), *extension.terms))


def _found(training: Training, values: NDArray, run: Run) -> Model | None:
    if all(run.run != trained.run for trained in training.runs):
        return None
    return training.model_of(run, values).for_run(run.run)


@dataclass(frozen=True)
class Step(Generic[Found]):
    """One of the two steps."""

    problem: Problem
    fit: Found


def _in_steps(training: Training, estimator: Estimator, runs: Runs) -> dict[str, Step[Fit]]:
    """Fit what is there in the empty exoskeleton, then, that being held, what comes with a human."""
    empty = np.array(
        [
            "exo_alone" in effect.acts_in and effect.run in (None, "exo_alone")
            for effect, _ in training.model.linear_parameters
        ]
    )
    values = np.zeros(len(empty))
    steps = {}
    for kind in runs.kinds:
        fitted = np.flatnonzero(empty if kind == "exo_alone" else ~empty)
        problem = Problem(training, (kind,), fitted, values)
        steps[kind] = Step(problem, estimator.fit(problem))
        values = _values(steps)
    return steps


def _values(steps: Mapping[str, Step[Any]]) -> NDArray:
    """Return the model's linear values, (p,)."""
    last = list(steps.values())[-1]
    return last.problem.completed(last.fit.values)


def _method(estimator: Estimator, steps: Mapping[str, Step[Estimate]], training: Training) -> dict[str, Any]:
    return {
        "name": f"two-step {estimator.title}",
        "estimator": estimator.name,
        "samples": "all" if training.reversals else f"all but {mask_in_words(training.runs[0].machine)}",
        "covariance": "sandwich with Bartlett-weighted long-run scores, Andrews' lag",
        "interval": "95 %, critical value after Kiefer and Vogelsang",
        "steps": {kind: step.fit.told for kind, step in steps.items()},
    }


def _answer_to_shapes(training: Training, extension: Extension, runs: Runs) -> NDArray:
    """Return how least-squares values answer to the shapes that are held, (p, s)."""
    model, shapes = training.model, extension.shapes
    answer = np.zeros((len(model.linear_parameters), len(shapes)))
    for i, variance in enumerate(np.diag(extension.shape_covariance)):
        if variance > 0.0:
            step = np.zeros(len(shapes))
            # A play or a stiffness of which little is known must not fall below nought.
            step[i] = min(STEP * np.sqrt(variance), 0.5 * abs(shapes[i]) or np.inf)
            either = [
                replace(training, model=_model(runs, extension.with_shapes(moved)))
                for moved in (shapes + step, shapes - step)
            ]
            ahead, behind = (_values(_in_steps(one, WeightedLeastSquares(), runs)) for one in either)
            answer[:, i] = (ahead - behind) / (2.0 * step[i])
    return answer


def _covariance(
    told: Sequence[Row], steps: Mapping[str, Step[Estimate]], extension: Extension, to_shapes: NDArray
) -> NDArray:
    """Return the covariance of some rows; what is not sure of step 1, or of a shape, is not sure of the rest.

    A shape and the amplitudes beside it are estimated from what each explains beyond the others: given the shape,
    the error of an amplitude does not go with that of the shape.
    """
    p, s = to_shapes.shape
    of_linear = np.zeros((p, p))
    for step in steps.values():
        onto = np.eye(p)[step.problem.fitted]
        carried = np.eye(p) + onto.T @ step.fit.carry
        of_linear = carried @ of_linear @ carried.T + onto.T @ step.fit.covariance @ onto
    through = np.vstack([to_shapes, np.eye(s)])
    covariance = through @ extension.shape_covariance @ through.T
    covariance[:p, :p] += of_linear
    slopes = np.array([row.slope for row in told])
    return slopes @ covariance @ slopes.T


def _critical(told: Sequence[Row], steps: Mapping[str, Step[Estimate]]) -> NDArray:
    """Return the half-width of each row's interval in standard errors: that of its fit, of several the least sure."""
    slopes = np.array([row.slope for row in told])
    own = [np.where(slopes[:, s.problem.fitted].any(axis=1), s.fit.critical, 0.0) for s in steps.values()]
    largest = np.max(own, axis=0)
    return np.where(largest > 0.0, largest, max(step.fit.critical for step in steps.values()))


def _unrealizable(table: pd.DataFrame, runs: Runs) -> list[str]:
    driving = table[(table["effect"] == "friction") & (table["ci95_high"] < 0.0)]
    return unrealizable(table, runs.motions[0].machine, runs.motions[0].geometry) + [
        f"{row['name']} friction of {row['joint']} is {row['value']:.3g} {row['unit']} ({row['ci95_low']:.3g} to "
        f"{row['ci95_high']:.3g}) and would drive the joint; look for a wrong sign of its torque or its angle, or for "
        "what is taken for friction (exoid diagnose)"
        for row in driving.to_dict("records")
    ]
