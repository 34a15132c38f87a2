"""The two-step fit, with any estimator.

Step 1 fits the rigid body and the friction of the empty exoskeleton. Step 2 holds both and fits the
rigid body of the wearer; step 1's covariance is carried into step 2's intervals. Other effects are
fitted in step 1, or in step 2 if they act with a human only. A fit of all parameters at once is the
check. Least squares reads each training run once to compress its rows, from which every fit
follows, and twice for the covariance of the residual.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Generic, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import block_diag

from pipelines.effects.baseline import Friction
from pipelines.estimation.angle_noise import CUTOFF_HZ, IN_WORDS, is_loud
from pipelines.estimation.collinearity import collinearities
from pipelines.estimation.estimator import Estimate, Estimator, Fit, estimated
from pipelines.estimation.least_squares import WeightedLeastSquares
from pipelines.estimation.parameter_table import Row, table_of
from pipelines.estimation.problem import Problem, Training
from pipelines.estimation.regression import mask_in_words
from pipelines.estimation.sandwich import sandwich
from pipelines.identification.extension import Extension, refuse_unread
from pipelines.identification.parameter_rows import rows
from pipelines.identification.runs import train_and_validate
from pipelines.identification.validation import Validation, validate
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.run import Run, kinds_of
from pipelines.mechanics.scale import on_one_scale
from pipelines.model import Model, baseline, unrealizable, upside_down

ROUNDS = 12
"""Most iterations of loads and rigid bodies."""

FitT = TypeVar("FitT", bound=Fit, covariant=True)


@dataclass(frozen=True)
class IdentifiedModel:
    """The result of an identification, with its uncertainty and remarks."""

    parameters: pd.DataFrame
    """``parameters/1``."""
    covariance: NDArray
    """(r, r), in the order of ``parameters``."""
    one_step: NDArray
    """(r,) values of a fit of all parameters at once, in the same order."""
    validation: Validation
    runs: tuple[Run, ...]
    """Training runs, then validation runs."""
    training: Training
    values: NDArray
    """(p,) values of the training's columns."""
    extension: Extension
    collinear: list[str]
    """A sentence for each set of parameters that the motion cannot separate."""
    unrealizable: list[str]
    """A sentence for each rigid body or friction that no real leg can have."""
    method: dict[str, Any]
    """Description of the method, for the file's metadata."""
    remarks: list[str]
    """Sentences of the method on these data, and on a machine with reversed gravity."""
    angle_noise: list[str]
    """A sentence if noise of the angles biases every fit; otherwise empty."""

    def model_of(self, run: Run) -> Model | None:
        """Return the model with a run's values; None without a training run of its kind."""
        return _as_model(self.training, self.values, run)

    @property
    def models(self) -> dict[str, Model]:
        """The model of each kind of run, with the values of its first training run."""
        first = {run.run: run for run in reversed(self.training.runs)}
        return {
            kind: self.training.model_of(run, self.values).for_run(kind)
            for kind, run in first.items()
        }

    @property
    def each_run(self) -> dict[str, list[dict[str, Any]]]:
        """Values that differ from run to run, by the effect's label, as in ``parameters/1``."""
        by_label: dict[str, list[dict[str, Any]]] = {}
        for run in self.runs if self.extension.recordings else ():
            for i, effect in enumerate(term.effect for term in self.training.model):
                places = {p.name: at for at, p in enumerate(effect.parameters) if p.per_run}
                if not places or not effect.acts(run.run):
                    continue
                term = self.training.term_of(run, i, self.values)
                values: dict[str, float | None] = dict.fromkeys(places)
                if term is not None:
                    physical = effect.physical(term.values)
                    values = {name: float(physical[at]) for name, at in places.items()}
                sha256 = self.extension.recordings[run.file]
                entry = {"name": run.file, "sha256": sha256, "values": values}
                by_label.setdefault(effect.label, []).append(entry)
        return by_label


def identify(
    motions: Sequence[Run],
    estimator: Estimator | None = None,
    extension: Extension | None = None,
    *,
    reversals: bool = False,
) -> IdentifiedModel:
    """Identify friction, the exoskeleton's rigid body and, from runs with one, the human's.

    Parameters
    ----------
    motions : sequence of Run
        Runs to train on and to validate on.
    estimator : Estimator, optional
        The method of both steps; weighted least squares unless given.
    extension : Extension, optional
        Effects in addition to rigid body and friction. Whole runs are then held in memory, because
        effects may have memory.
    reversals : bool
        Whether samples near reversals are also fitted.

    Raises
    ------
    InputError
        If runs are missing, are of several machines or lack a column that the method needs.
    NotIdentifiable
        If the motion cannot separate the parameters.
    """
    estimator, extension = estimator or WeightedLeastSquares(), extension or Extension()
    train, judged = train_and_validate(on_one_scale(motions))
    estimator.refuse_unmeasured(train[0].machine)
    loud = is_loud(train)
    refuse_unread(extension.terms, [*train, *judged])
    training, has_converged = _training(train, extension, reversals, CUTOFF_HZ if loud else None)
    training = _about_passive_joints(training)
    # Torques that depend on load need it in validation runs too, from the fitted bodies.
    judged = [training.loaded(run) for run in judged]
    steps = {
        kind: Step(one.problem, estimated(one.fit))
        for kind, one in _in_steps(training, estimator).items()
    }
    values = _values(steps)
    table_rows = list(rows(training, values))
    covariance = _covariance(table_rows, steps, extension, training)
    error = np.sqrt(np.diag(covariance))
    # A held value has an error of zero here because its error is unknown, not because it is exact.
    known_error = np.where(error > 0.0, error, np.nan)
    table = table_of(table_rows, known_error, _critical(table_rows, steps, extension))
    biased = (
        f"{IN_WORDS}, so every fit underestimates inertia. Set filter.cutoff_hz ="
        f" {CUTOFF_HZ:g}, and check encoder counts and time stamps"
    )
    # One fit of all columns is the check: friction that changes with a wearer shows there.
    fitted = np.flatnonzero(~training.undetermined)
    everything = Problem(training, training.kinds, fitted, np.zeros(len(values)))
    whole = everything.completed(estimator.fit(everything).values)
    return IdentifiedModel(
        parameters=table,
        covariance=covariance,
        one_step=np.array([row.value for row in rows(training, whole)]),
        validation=validate(judged, partial(_as_model, training, values), training.cutoff_hz),
        runs=(*training.runs, *judged),
        training=training,
        values=values,
        extension=extension,
        collinear=[
            f"{kind}: {sentence}"
            for kind, step in steps.items()
            for sentence in collinearities(step.fit.normal, step.problem.names)
        ],
        unrealizable=_unrealizable(table, train[0]),
        method=_method(estimator, steps, training),
        remarks=[
            *(f"{kind}: {remark}" for kind, step in steps.items() for remark in step.fit.remarks),
            *upside_down(table, train[0].machine),
            *_unmeasured(train[0].machine),
            *extension.remarks,
            *_limits(estimator, training, has_converged),
        ],
        angle_noise=[biased] * (loud and training.cutoff_hz is None),
    )


def _unmeasured(machine: Machine) -> list[str]:
    """Return a remark on joints whose torque was not measured."""
    words = machine.unmeasured_in_words
    return [f"{words}; parameters that do not act on these are left out"] if words else []


def _limits(estimator: Estimator, training: Training, has_converged: bool) -> Iterator[str]:
    """Yield a sentence if bodies and loads did not converge, or high frequencies do not count."""
    if not has_converged:
        yield (
            f"rigid bodies and loads did not converge in {ROUNDS} iterations, so these values are"
            " not reliable. A fixed shape, such as a soft spring's, may not fit these runs"
        )
    if training.cutoff_hz is not None:
        use = "fitted or scored" if estimator.masks else "scored"
        yield f"{IN_WORDS}, so nothing above {CUTOFF_HZ:g} Hz is {use}, as in the diagnosis"


def _training(
    train: Sequence[Run], extension: Extension, reversals: bool, cutoff_hz: float | None
) -> tuple[Training, bool]:
    """Return runs and model to fit, with loads, and whether loads and bodies have converged.

    A model without extension is fitted piece by piece, without a cut-off.
    """
    plain = Model.of(baseline(train[0].machine, kinds_of(train)))
    model = Model((*plain, *extension.terms))
    own = {file: (*plain, *terms) for file, terms in extension.own.items()}
    if not extension.terms and not extension.bodies:
        return Training(tuple(train), model, reversals=reversals), True
    whole = tuple(run.whole() for run in train)
    training = Training(whole, model, own, reversals=reversals, cutoff_hz=cutoff_hz)
    bodies = extension.bodies
    # Loads need bodies before the first fit; those of the plain model start the iteration.
    if not set(_body_keys(training)) <= set(bodies):
        alone = Training(whole, plain, reversals=reversals, cutoff_hz=cutoff_hz)
        bodies = _bodies(alone, _values(_in_steps(alone, WeightedLeastSquares())))
    return _with_consistent_loads(training, bodies)


def _about_passive_joints(training: Training) -> Training:
    """Return the training with the equations of passive joints free of scale (``Training.about``).

    They are linearized about each fit in turn; three suffice, as the first is nearly right.
    """
    if not any(joint.is_passive for joint in training.runs[0].machine.joints):
        return training
    for _ in range(3):
        values = _values(_in_steps(training, WeightedLeastSquares()))
        training = replace(training, about=values)
    return training


def _body_keys(training: Training) -> list[str]:
    """Return the keys of the fitted rigid bodies: each kind of run, and the wearer."""
    return [*training.kinds, *["human"] * ("with_human" in training.kinds)]


def _with_consistent_loads(
    training: Training, bodies: Mapping[str, NDArray]
) -> tuple[Training, bool]:
    """Return the training with loads of the fitted rigid bodies, and whether these converged.

    The iteration starts from ``bodies``. Behind an elastic joint fixed-point steps overshoot, so
    their length follows from the last two (Aitken, 1926, Proc. Royal Society of Edinburgh 46).
    """
    # Relative change of rigid bodies at which the iteration has converged.
    tolerance = 1e-3
    kinds = _body_keys(training)
    sizes = np.cumsum([len(bodies[kind]) for kind in kinds])[:-1]
    values = np.concatenate([bodies[kind] for kind in kinds])
    last_step, last_length = None, 1.0
    for _ in range(ROUNDS):
        now = dict(zip(kinds, np.split(values, sizes), strict=True))
        training = training.with_bodies(
            # All bodies are behind the drives, but inside the cuffs is the wearer's limb alone.
            {kind: (now[kind], now.get("human", now[kind])) for kind in training.kinds}
        )
        fitted_bodies = _bodies(training, _values(_in_steps(training, WeightedLeastSquares())))
        step = np.concatenate([fitted_bodies[kind] for kind in kinds]) - values
        # A parameter that nothing determines stays at zero.
        if np.all(np.abs(step) <= tolerance * np.abs(values)):
            return training, True
        growth = 0.0
        # If the map has slope g, a step of length l leaves 1 - l (1 - g) of the residual. The ratio
        # of two residuals gives g, and 1 / (1 - g) is the length to the fixed point.
        if last_step is not None:
            ratio = float(step @ last_step / (last_step @ last_step))
            growth = ratio / last_length + 1.0 - 1.0 / last_length
        # Two steps determine the slope roughly, so the length stays between a quarter and two.
        last_length = 1.0 / (1.0 - np.clip(growth, -3.0, 0.5))
        last_step = step
        values = values + last_length * step
    return training, False


def _bodies(training: Training, values: NDArray) -> dict[str, NDArray]:
    """Return the rigid body of each kind of run, and the wearer's, (k,) each."""
    layout = training.layout
    bodies = {kind: values[layout.bodies_in(kind)].sum(axis=0) for kind in training.kinds}
    if "human" in _body_keys(training):
        bodies["human"] = values[layout.bodies[-1]]
    return bodies


def _as_model(training: Training, values: NDArray, run: Run) -> Model | None:
    if run.run not in training.kinds:
        return None
    return training.model_of(run, values).for_run(run.run)


@dataclass(frozen=True)
class Step(Generic[FitT]):
    """One of the two steps."""

    problem: Problem
    fit: FitT


def _in_steps(training: Training, estimator: Estimator) -> dict[str, Step[Fit]]:
    """Fit the parameters of the empty exoskeleton, then, with these fixed, the human's."""
    empty = training.layout.acting_in("exo_alone")
    # The wearer's columns are zero in runs without one, so that any values of them serve step 1.
    values = np.zeros(len(empty))
    steps = {}
    for kind in training.kinds:
        acting = empty if kind == "exo_alone" else ~empty
        fitted = np.flatnonzero(acting & ~training.undetermined)
        problem = Problem(training, (kind,), fitted, values)
        steps[kind] = Step(problem, estimator.fit(problem))
        values = _values(steps)
    return steps


def _values(steps: Mapping[str, Step[Any]]) -> NDArray:
    """Return the values of the training's columns, (p,)."""
    last = list(steps.values())[-1]
    return last.problem.completed(last.fit.values)


def _method(
    estimator: Estimator, steps: Mapping[str, Step[Estimate]], training: Training
) -> dict[str, Any]:
    away = f"all but {mask_in_words(training.runs[0].machine)}"
    return {
        "name": f"two-step {estimator.title}",
        "estimator": estimator.name,
        "samples": "all" if training.reversals or not estimator.masks else away,
        "covariance": "sandwich with Bartlett-weighted long-run scores, Andrews' lag",
        "interval": "95 %, critical value after Kiefer and Vogelsang",
        "steps": {kind: step.fit.about for kind, step in steps.items()},
    }


def _sensitivities(training: Training, covariance: NDArray) -> tuple[NDArray, NDArray]:
    """Return the slopes of least-squares values by fixed shapes, and the shapes' covariance.

    They are (p, h) and (h, h) arrays. ``covariance`` (s, s) is that of the terms' shapes, in the
    first run if they differ from run to run. Shapes in other runs have the same variance, and are
    independent.
    """
    error = np.sqrt(np.diag(covariance))
    shapes = [(i, k) for i, term in enumerate(training.model) for k in range(len(term.shape))]
    first, others = [], []
    for (i, k), e in zip(shapes, error, strict=True):
        files = [training.runs[run].file for run in training.layout.terms[i].runs]
        if training.model.terms[i].effect.shape[k].per_run:
            first.append((i, k, e, files[:1]))
            others += [(i, k, e, [file]) for file in files[1:]]
        else:
            first.append((i, k, e, files))
    slopes = [_sensitivity(training, *shape) for shape in (*first, *others)]
    every = block_diag(covariance, np.diag([e**2 for _, _, e, _ in others]))
    return np.reshape(slopes, (len(slopes), training.layout.size)).T, every


def _sensitivity(
    training: Training, term: int, shape: int, error: float, files: Sequence[str]
) -> NDArray:
    """Return the slope of least-squares values, (p,), by a term's shape in some runs."""
    if error == 0.0 or not files:
        return np.zeros(training.layout.size)
    now = abs(training.model.terms[term].shape[shape])
    # An uncertain backlash or stiffness must stay positive.
    # The step is a part of the error, over which the fit must be linear for the interval to hold.
    step = min(0.25 * error, 0.5 * now or np.inf)
    # Two fits for each shape cost too much with a method that simulates, so all use least squares.
    ahead, behind = (
        _values(_in_steps(training.reshaped(term, shape, moved, files), WeightedLeastSquares()))
        for moved in (step, -step)
    )
    return (ahead - behind) / (2.0 * step)


def _covariance(
    rows: Sequence[Row],
    steps: Mapping[str, Step[Estimate]],
    extension: Extension,
    training: Training,
) -> NDArray:
    """Return the covariance of some rows, with the uncertainty of step 1 and of shapes.

    Errors of shapes and of amplitudes count as independent. In white noise they are, since each is
    estimated from what the other does not explain.
    """
    to_shapes, of_shapes = _sensitivities(training, extension.covariance)
    p, h = to_shapes.shape
    of_linear = np.zeros((p, p))
    for step in steps.values():
        # Fitted values move with those that are held, whose covariance is carried on to them.
        onto = np.eye(p)[step.problem.fitted]
        carried = np.eye(p) + onto.T @ step.fit.carry
        of_linear = carried @ of_linear @ carried.T + onto.T @ step.fit.covariance @ onto
    through = np.vstack([to_shapes, np.eye(h)])
    covariance = through @ of_shapes @ through.T
    covariance[:p, :p] += of_linear
    # Rows know the shapes of the first run only; those of other runs are last, and end here.
    size = len(rows[0].slope)
    return sandwich(np.array([row.slope for row in rows]), covariance[:size, :size])


def _critical(
    rows: Sequence[Row], steps: Mapping[str, Step[Estimate]], extension: Extension
) -> NDArray:
    """Return the half-width of each row's interval in standard errors.

    Parameters fitted with a human have the larger value of both steps; fixed ones keep theirs.
    """
    slopes = np.array([row.slope for row in rows])
    critical, largest = np.full(len(rows), extension.critical), 0.0
    for step in steps.values():
        largest = max(largest, step.fit.critical)
        critical[slopes[:, step.problem.fitted].any(axis=1)] = largest
    return critical


def _unrealizable(table: pd.DataFrame, run: Run) -> list[str]:
    # Friction that is negative within its interval may be noise.
    driving = table[(table["effect"] == Friction.name) & (table["ci95_high"] < 0.0)]
    return unrealizable(table, run.machine, run.geometry) + [
        f"{row['name']} friction of {row['joint']} is {row['value']:.3g} {row['unit']}"
        f" ({row['ci95_low']:.3g} to {row['ci95_high']:.3g}) and drives the joint. Check the signs"
        " of its torque and angle, or look for a missing effect with exoid diagnose"
        for row in driving.to_dict("records")
    ]
