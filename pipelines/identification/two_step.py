"""The two-step fit, by whatever estimator.

Step 1 fits the rigid body and the friction of the empty exoskeleton. Step 2 holds both and fits the
rigid body of the wearer; step 1's covariance is carried into step 2's intervals. What the model has
beside them is fitted in step 1, or in step 2 where it acts with a human only. A fit of everything
at once is computed beside it as a check. Least squares goes through each training run once to
compress its rows, from which every fit follows, and twice for the covariance of what the fit left.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import block_diag

from pipelines.estimation.angle_noise import CUTOFF_HZ, IN_WORDS, is_loud
from pipelines.estimation.collinearity import collinearities
from pipelines.estimation.estimator import Estimate, Estimator, Fit, estimated
from pipelines.estimation.least_squares import WeightedLeastSquares
from pipelines.estimation.parameter_table import Row, table_of
from pipelines.estimation.problem import Problem, Training
from pipelines.estimation.regression import mask_in_words
from pipelines.identification.extension import Extension, refuse_unread
from pipelines.identification.parameter_rows import rows
from pipelines.identification.runs import Runs, checked
from pipelines.identification.validation import Validation, validate
from pipelines.mechanics.run import Run
from pipelines.mechanics.scale import on_one_scale
from pipelines.model import Model, baseline, unrealizable, upside_down

BIASED = (
    f"{IN_WORDS}, which lets every fit take the machine for too light; set filter.cutoff_hz ="
    f" {CUTOFF_HZ:g}, and see to encoder counts and time stamps"
)
SLOWLY = f"{IN_WORDS}, so that nothing above {CUTOFF_HZ:g} Hz is {{}}, as in the diagnosis"
STEP = 0.25
"""Standard errors by which a shape is moved to see what the values make of it."""
ROUNDS, RESTS = 12, 1e-3
"""In which loads follow the rigid bodies that they are of, and the relative change at which these
are at rest."""
RESTLESS = (
    f"the rigid bodies and the loads that they make did not come to agree in {ROUNDS} rounds, so"
    " these values are not to be trusted: some shape that is held, as a soft spring's, does not go"
    " with these runs"
)

FitT = TypeVar("FitT", bound=Fit, covariant=True)


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
    """(p,) of the training's columns."""
    extension: Extension
    collinear: list[str]
    """What this motion cannot separate, a sentence each."""
    unrealizable: list[str]
    """Which rigid bodies, and which friction, no real leg could have, a sentence each."""
    method: dict[str, Any]
    """How it was found, for the file's metadata."""
    remarks: list[str]
    """What the method says of these data, and of a machine that would stand on its head, a sentence
    each."""
    angle_noise: list[str]
    """A sentence where noise of the angles biases every fit; empty where it does not."""

    def model_of(self, run: Run) -> Model | None:
        """Return what was found, as it is in a run; None where none of its kind was trained on."""
        return _as_model(self.training, self.values, run)

    @property
    def models(self) -> dict[str, Model]:
        """What was found, for each kind of run; what each run has for itself is as in the first
        trained on."""
        first = {run.run: run for run in reversed(self.training.runs)}
        return {
            kind: self.training.model_of(run, self.values).for_run(kind)
            for kind, run in first.items()
        }

    @property
    def each_run(self) -> dict[str, list[dict[str, Any]]]:
        """What each run has for itself, by the effect's label, as ``parameters/1`` tells it."""
        by_label: dict[str, list[dict[str, Any]]] = {}
        for run in self.runs if self.extension.recordings else ():
            for i, effect in enumerate(term.effect for term in self.training.model):
                own = [(place, p.name) for place, p in enumerate(effect.parameters) if p.per_run]
                if own and effect.acts(run.run):
                    term = self.training.term_of(run, i, self.values)
                    values = None if term is None else effect.physical(term.values)
                    by_label.setdefault(effect.label, []).append(
                        {
                            "name": run.file,
                            "sha256": self.extension.recordings[run.file],
                            "values": {
                                name: None if values is None else float(values[at])
                                for at, name in own
                            },
                        }
                    )
        return by_label


def identify(
    motions: Sequence[Run],
    estimator: Estimator | None = None,
    extension: Extension | None = None,
    *,
    reversals: bool = False,
) -> Identified:
    """Identify friction, the exoskeleton's rigid body and, where there are runs with one, the
    human's.

    Parameters
    ----------
    motions : sequence of Run
        Runs to train on and to validate on.
    estimator : Estimator, optional
        The method of both steps; weighted least squares unless given.
    extension : Extension, optional
        What the model has beside rigid body and friction. Whole runs are then held in memory, for
        it may remember.
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
    loud = is_loud(runs.of("train"))
    refuse_unread(extension.terms, [*runs.of("train"), *runs.of("validate")])
    training, at_rest = _training(runs, extension, reversals, CUTOFF_HZ if loud else None)
    judged = [training.loaded(run) for run in runs.of("validate")]
    steps = {
        kind: Step(one.problem, estimated(one.fit))
        for kind, one in _in_steps(training, estimator).items()
    }
    values = _values(steps)
    table_rows = list(rows(training, values))
    covariance = _covariance(table_rows, steps, extension, training)
    error = np.sqrt(np.diag(covariance))
    table = table_of(
        table_rows, np.where(error > 0.0, error, np.nan), _critical(table_rows, steps, extension)
    )
    everything = Problem(training, runs.kinds, np.arange(len(values)), np.zeros(len(values)))
    return Identified(
        parameters=table,
        covariance=covariance,
        one_step=np.array([row.value for row in rows(training, estimator.fit(everything).values)]),
        validation=validate(
            judged, lambda run: _as_model(training, values, run), training.cutoff_hz
        ),
        runs=(*training.runs, *judged),
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
            *[RESTLESS] * (not at_rest),
            *[SLOWLY.format("fitted or scored" if estimator.masks else "scored")]
            * (training.cutoff_hz is not None),
        ],
        angle_noise=[BIASED] * (loud and training.cutoff_hz is None),
    )


def _training(
    runs: Runs, extension: Extension, reversals: bool, cutoff_hz: float | None
) -> tuple[Training, bool]:
    """Return what is fitted to what, with the loads that terms may go with, and whether those are
    at rest.

    The plain model is fitted piece by piece, whatever is above the cut-off.
    """
    train = tuple(runs.of("train"))
    plain = Model.of(baseline(runs.motions[0].machine, runs.kinds))
    model = Model((*plain, *extension.terms))
    own = {file: (*plain, *terms) for file, terms in extension.own.items()}
    if not extension.terms and not extension.bodies:
        return Training(train, model, reversals=reversals), True
    train = tuple(run.whole() for run in train)
    training = Training(train, model, own, reversals=reversals, cutoff_hz=cutoff_hz)
    bodies = extension.bodies
    if not set(_whose(training)) <= set(bodies):
        alone = Training(train, plain, reversals=reversals, cutoff_hz=cutoff_hz)
        bodies = _bodies(alone, _values(_in_steps(alone, WeightedLeastSquares())))
    return _under_its_own_loads(training, bodies)


def _whose(training: Training) -> list[str]:
    """Return whose rigid bodies are found: each kind of run's, and the wearer's own."""
    return [*training.kinds, *["human"] * ("with_human" in training.kinds)]


def _under_its_own_loads(
    training: Training, bodies: Mapping[str, NDArray]
) -> tuple[Training, bool]:
    """Return the training with the loads of the rigid bodies that it finds, and whether it found
    them in the end.

    The first round's are of ``bodies``. Behind an elastic joint what is found overshoots, round
    after round, so each step is as long as the last two tell (Aitken, 1926, Proc. Royal Society of
    Edinburgh 46).
    """
    kinds = _whose(training)
    sizes = np.cumsum([len(bodies[kind]) for kind in kinds])[:-1]
    at, last = np.concatenate([bodies[kind] for kind in kinds]), None
    for _ in range(ROUNDS):
        now = dict(zip(kinds, np.split(at, sizes), strict=True))
        training = training.with_bodies(
            {kind: (now[kind], now.get("human", now[kind])) for kind in training.kinds}
        )
        fitted_bodies = _bodies(training, _values(_in_steps(training, WeightedLeastSquares())))
        step = np.concatenate([fitted_bodies[kind] for kind in kinds]) - at
        if np.all(np.abs(step) < RESTS * np.abs(at)):
            return training, True
        growth = (
            0.0
            if last is None
            else float(step @ last[0] / (last[0] @ last[0])) / last[1] + 1.0 - 1.0 / last[1]
        )
        length = 1.0 / (1.0 - np.clip(growth, -3.0, 0.5))
        last, at = (step, length), at + length * step
    return training, False


def _bodies(training: Training, values: NDArray) -> dict[str, NDArray]:
    """Return the rigid body behind the drive trains in each kind of run, and the wearer's own, (k,)
    each."""
    layout = training.layout
    bodies = {kind: values[layout.bodies_in(kind)].sum(axis=0) for kind in training.kinds}
    return bodies | ({"human": values[layout.bodies[-1]]} if "human" in _whose(training) else {})


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
    """Fit what is there in the empty exoskeleton, then, that being held, what comes with a
    human."""
    empty = training.layout.acting_in("exo_alone")
    values = np.zeros(len(empty))
    steps = {}
    for kind in training.kinds:
        fitted = np.flatnonzero(empty if kind == "exo_alone" else ~empty)
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


def _answers(training: Training, covariance: NDArray) -> tuple[NDArray, NDArray]:
    """Return how least-squares values answer to shapes that are held, (p, h), and the shapes'
    covariance, (h, h).

    ``covariance`` (s, s) is that of the terms' shapes, one after the other; of what each run has
    for itself, as its first run has it. Other runs' are taken to be as sure, and for themselves.
    """
    error = np.sqrt(np.diag(covariance))
    shapes = [(i, k) for i, term in enumerate(training.model) for k in range(len(term.shape))]
    own, others = [], []
    for (i, k), e in zip(shapes, error, strict=True):
        having = [training.runs[run].file for run in training.layout.terms[i].runs]
        apart = training.model.terms[i].effect.shape[k].per_run
        own.append((i, k, e, having[:1] if apart else having))
        others += [(i, k, e, [file]) for file in having[1:]] if apart else []
    answers = [_answer(training, *moved) for moved in (*own, *others)]
    every = block_diag(covariance, np.diag([e**2 for _, _, e, _ in others]))
    return np.reshape(answers, (len(answers), training.layout.size)).T, every


def _answer(
    training: Training, term: int, shape: int, error: float, files: Sequence[str]
) -> NDArray:
    """Return how least-squares values, (p,), change with a term's shape in some runs."""
    if error == 0.0 or not files:
        return np.zeros(training.layout.size)
    now = abs(training.model.terms[term].shape[shape])
    # A play or a stiffness of which little is known must not fall below nought.
    step = min(STEP * error, 0.5 * now or np.inf)
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
    """Return the covariance of some rows; what is not sure of step 1, or of a shape, is not sure of
    the rest.

    A shape and the amplitudes beside it are estimated from what each explains beyond the others:
    given the shape, the error of an amplitude hardly goes with that of the shape, and not at all in
    white noise.
    """
    to_shapes, of_shapes = _answers(training, extension.covariance)
    p, h = to_shapes.shape
    of_linear = np.zeros((p, p))
    for step in steps.values():
        onto = np.eye(p)[step.problem.fitted]
        carried = np.eye(p) + onto.T @ step.fit.carry
        of_linear = carried @ of_linear @ carried.T + onto.T @ step.fit.covariance @ onto
    through = np.vstack([to_shapes, np.eye(h)])
    covariance = through @ of_shapes @ through.T
    covariance[:p, :p] += of_linear
    size = len(rows[0].slope)
    slopes = np.array([row.slope for row in rows])
    return slopes @ covariance[:size, :size] @ slopes.T


def _critical(
    rows: Sequence[Row], steps: Mapping[str, Step[Estimate]], extension: Extension
) -> NDArray:
    """Return the half-width of each row's interval in standard errors.

    What is fitted with a human is no surer than the less sure of both steps, what is held as sure
    as it was found.
    """
    slopes = np.array([row.slope for row in rows])
    critical, least = np.full(len(rows), extension.critical), 0.0
    for step in steps.values():
        least = max(least, step.fit.critical)
        critical[slopes[:, step.problem.fitted].any(axis=1)] = least
    return critical


def _unrealizable(table: pd.DataFrame, runs: Runs) -> list[str]:
    driving = table[(table["effect"] == "friction") & (table["ci95_high"] < 0.0)]
    return unrealizable(table, runs.motions[0].machine, runs.motions[0].geometry) + [
        f"{row['name']} friction of {row['joint']} is {row['value']:.3g} {row['unit']}"
        f" ({row['ci95_low']:.3g} to {row['ci95_high']:.3g}) and would drive the joint; look for a"
        " wrong sign of its torque or its angle, or for what is taken for friction (exoid"
        " diagnose)"
        for row in driving.to_dict("records")
    ]
