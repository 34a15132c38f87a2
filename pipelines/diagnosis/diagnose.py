"""The whole diagnosis: recordings in, verdict and tables out."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import the
from pipelines.diagnosis import tables
from pipelines.diagnosis.bank import Bank, fill, silent
from pipelines.diagnosis.choice import (
    Choice,
    choose,
    dilution,
    idle,
    nothing_chosen,
    of_a_freer_form,
    probabilities,
    rivals,
)
from pipelines.diagnosis.examined import Examined, Extended, gains_beside
from pipelines.diagnosis.faults import Fault, excluding, find_faults
from pipelines.diagnosis.fit import Fit, fit, residuals_on
from pipelines.diagnosis.fitted_model import model_of_run, values_of_each_run
from pipelines.diagnosis.floor import Floor, noise_floor
from pipelines.diagnosis.freer_form import FreerForm
from pipelines.diagnosis.gain import Gain, errors_of
from pipelines.diagnosis.imperfection import imperfection
from pipelines.diagnosis.known import known_effects
from pipelines.diagnosis.observations import Baseline, Run, baseline_of, like_trained, observe, with_load
from pipelines.diagnosis.perceived import heard_in
from pipelines.diagnosis.reversals import BuildUp, built_up
from pipelines.diagnosis.search import Scorer
from pipelines.diagnosis.second_look import slower
from pipelines.diagnosis.session import refuse_unfit
from pipelines.diagnosis.status import Standing, status_of
from pipelines.diagnosis.thinned import thinned
from pipelines.diagnosis.ties import ALIKE
from pipelines.diagnosis.uncertainty import Uncertainty, uncertainty
from pipelines.dynamics.replay import replay
from pipelines.effects import Effect
from pipelines.effects.force_sensor_zero import ForceSensorZero
from pipelines.effects.rigid_body import RigidBody
from pipelines.errors import ExoidError, InputError
from pipelines.estimation.angle_noise import CUTOFF_HZ, is_loud
from pipelines.estimation.collinearity import collinearities, profiled
from pipelines.label import effect_labelled
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.origin import giving
from pipelines.mechanics.scale import on_one_scale
from pipelines.model import Column, unrealizable, upside_down

SEARCH_SHARE = 0.75
"""Of the progress bar that filling the bank takes."""
OR_A_FREER_FORM = 0.5
"""No spring is straight all the way, no drag a mere square: what one that bends explains as well is likely as not."""
OR_NO_MACHINE = 0.5
"""Causes beside which no machine has the rigid body may have taken a part of it for something else."""


@dataclass(frozen=True)
class Diagnosis:
    """Everything a verdict is written from."""

    baseline: Baseline
    bank: Bank
    choice: Choice
    status: str
    before: Extended
    after: Extended
    without: dict[str, Extended]
    """The named set less one cause, by that cause's label."""
    likely: dict[str, dict[str, float]]
    """For each named cause the probability of it and of each that could stand in its place."""
    idle: dict[str, frozenset[str]]
    """Those of these that explain nothing."""
    of_a_freer_form: dict[str, type[FreerForm]]
    """Named causes that explain no more than another of them would in a freer form, and which form."""
    standing: Standing
    floor: Floor
    unsteady: bool
    """Whether something that is left hums, or does not repeat with the motion."""
    perceived: tuple[str, ...]
    """Labels of the named causes that were heard or felt."""
    sure: Uncertainty
    parameters: pd.DataFrame
    covariance: NDArray
    residuals: pd.DataFrame
    train: tuple[Run, ...]
    validate: tuple[Run, ...]
    faults: tuple[Fault, ...]
    strayed: dict[str, NDArray | None]
    """(J,) rad: the 1 s simulation error of the baseline and of the extended model."""
    noisy_angles: bool
    """Whether only what the angles hold below 5 Hz was looked at, for above it is noise."""
    reversals: tuple[BuildUp, ...]
    """Joints whose friction builds up over a travel where they turn round, which nothing else here looks at."""

    @property
    def collinear(self) -> list[str]:
        """Which parameters of the extended model the training runs hardly tell apart, in words."""
        fit = self.choice.named.fit
        shapes = [(fit.causes[number].effect, i) for number, i, _ in self.sure.shapes]
        columns = [*fit.layout.columns, *(Column(effect, effect.shape[i], None) for effect, i in shapes)]
        # Nobody asks for the zeros of the cuffs.
        zeros = [isinstance(column.effect, ForceSensorZero) for column in columns]
        names = [column.name for column, zero in zip(columns, zeros, strict=True) if not zero]
        normal = profiled(self.sure.normal, np.flatnonzero(zeros))
        seen = np.flatnonzero(np.diag(normal) > 0.0)
        return collinearities(normal[np.ix_(seen, seen)], [names[place] for place in seen])

    @property
    def unrealizable(self) -> list[str]:
        """Why no real machine has the extended model's rigid bodies; empty when one may."""
        return unrealizable(self.parameters, self.baseline.machine, self.train[0].motion.geometry)

    @cached_property
    def lacks_mass(self) -> bool:
        """Whether a rigid body has a least inertia below nought by more than its standard error."""
        table, geometry = self.parameters.reset_index(drop=True), self.train[0].motion.geometry
        for _, rows in table[table["effect"] == RigidBody.name].groupby("run"):
            own = rows.index.to_numpy()
            least, _, slope = self.baseline.machine.mechanism.least_inertia(rows["value"], geometry)
            if least < -np.sqrt(slope @ self.covariance[np.ix_(own, own)] @ slope):
                return True
        return False

    @property
    def upside_down(self) -> list[str]:
        """Which links the extended model has standing on their heads; empty when none."""
        return upside_down(self.parameters, self.baseline.machine)

    @property
    def causes(self) -> tuple[str, ...]:
        """Labels of the named causes, the most probable first; among equals that which explains most alone."""
        if self.status in ("unknown_cause", "nothing_missing"):
            return ()

        def order(label: str) -> tuple[float, float]:
            return (-round(self.chance(label), 1), -self.choice.alone(label))

        return tuple(sorted(self.likely, key=order))

    @cached_property
    def effects(self) -> dict[str, Effect]:
        """The named effects as they were fitted, by label."""
        return {cause.label: cause.effect for cause in self.choice.named.fit.causes}

    @cached_property
    def each_run(self) -> dict[str, list[dict[str, Any]]]:
        """What each run has for itself of the named causes, by label."""
        return values_of_each_run(self.choice.named.fit, self.baseline, self.sure, self.train, self.validate)

    @cached_property
    def gains(self) -> dict[str, Gain]:
        """What each named cause gains on the validation runs beside the others, by its label."""
        return gains_beside(self.without, self.after)

    @cached_property
    def torque_rms(self) -> NDArray:
        """(J,) N·m that was measured, on the samples that the errors are of."""
        return errors_of(self.validate, [run.measured for run in self.validate]).rms

    @property
    def spoilt(self) -> list[Fault]:
        """Faults of acquisition beside which no physics is blamed."""
        return [fault for fault in self.faults if fault.spoils]

    def chance(self, label: str) -> float:
        """Return how likely a named cause is among its rivals, with those that cannot be told from it."""
        among_rivals = min(sum(self.alike(label).values()), 1.0)
        bent = OR_A_FREER_FORM if label in self.of_a_freer_form else 1.0
        return among_rivals * bent * (OR_NO_MACHINE if self.lacks_mass else 1.0)

    def alike(self, label: str) -> dict[str, float]:
        """Return a named cause and those that cannot be told from it, with their probabilities."""
        odds = self.likely[label]
        explaining = {other: p for other, p in odds.items() if other not in self.idle[label]}
        return {other: p for other, p in explaining.items() if p >= ALIKE * odds[label]}


def diagnose(
    motions: Sequence[Motion], report: Callable[[float, str], None] = silent, known: Sequence[str] = ()
) -> Diagnosis:
    """Find what the rigid body with Coulomb and viscous friction gets wrong, and why.

    Selection, shapes and shared parameters use ``train`` runs; every error is measured on ``validate`` runs, which
    may refute a set, and then decide among those that training can hardly tell from it.

    Parameters
    ----------
    motions : sequence of Motion
        Runs of one machine, some to train and some to validate.
    report : callable, optional
        Told the share that is done, 0 to 1, and what is being tried.
    known : sequence of str, optional
        Labels of what the machine is known to have besides rigid body and friction: part of the baseline.

    Raises
    ------
    InputError
        Where there is no run to train or none to validate on, or no baseline can have what is ``known``.
    """
    motions = on_one_scale(motions)
    refuse_unfit(motions)
    beside = known_effects(known, motions[0].machine)
    faults = tuple(find_faults(motions))
    sound = [thinned(motion) for motion in excluding(motions, faults) if motion.valid.any()]
    train, validate = _dealt(sound)
    if noisy := is_loud([run.motion for run in train]):
        train, validate = _dealt(sound, CUTOFF_HZ)
    if not any(fault.spoils for fault in faults):
        _refuse_without_floor(validate)
    look = partial(_look, known=beside, faults=faults, noisy_angles=noisy, report=report)
    first = look(train, validate)
    if noisy or first.spoilt or not (first.status == "unknown_cause" or (first.unsteady and _rings(first))):
        return first
    second = look(*_dealt([slower(m) for m in sound]))
    # Slow motion shows a transmission that rang too loud, and what was only hidden in noise; what failed as anything
    # else may not come back.
    hidden = bool(second.causes) and not first.choice.named.labels and not first.choice.refuted
    return second if _rings(second) or hidden else first


def _rings(found: Diagnosis) -> bool:
    """Tell whether a transmission that swings on its load is named."""
    return any(effect_labelled(label).rings for label in found.causes)


def _look(
    train: Sequence[Run],
    validate: Sequence[Run],
    known: Sequence[Effect],
    faults: tuple[Fault, ...],
    noisy_angles: bool,
    report: Callable[[float, str], None],
) -> Diagnosis:
    """Diagnose at the bandwidth that the runs have."""
    baseline = baseline_of(train, known)
    bank = fill(train, baseline, lambda share, what: report(SEARCH_SHARE * share, what))
    empty = fit((), bank.runs, baseline, bank.weights)
    validate = tuple(with_load(like_trained(run, baseline), baseline, empty.values) for run in validate)
    report(SEARCH_SHARE, "combinations")
    left = residuals_on(empty, bank.runs, baseline)
    spoilt = any(fault.spoils for fault in faults)
    evidence = heard_in(bank.runs, left)
    choice = nothing_chosen(empty) if spoilt else choose(bank, noise_floor(bank.runs, left), evidence)
    before = Extended.of(empty, validate, baseline)
    examine = partial(Examined.of, before=before, validate=validate, bank=bank)
    examined = examine(choice)
    if bool(np.any(examined.standing.systematic(examined.standing.slow_before))) and (faint := choice.faint()):
        choice, examined = faint, examine(faint)
    while choice.named.labels and not examined.holds_up:
        # What the training runs promised does not hold on others: the next of those they can hardly tell from it, or
        # else what was heard or felt needs no other beside it.
        choice = choice.next_best() or choice.just(examined.sure) or choice.none_left(empty)
        examined = examine(choice)
    while (fewer := choice.just(examined.helpful)) and (of_fewer := examine(fewer)).holds_up:
        choice, examined = fewer, of_fewer
    after, floor, standing = examined.after, examined.floor, examined.standing
    report(0.95, "intervals")
    named = choice.named.labels
    status = "unknown_cause" if spoilt else status_of(standing, bool(named), examined.unsteady)
    diluted = dilution(choice, bank) if named else 1.0
    scorer = Scorer(bank, choice.independent, evidence)
    sure = uncertainty(choice.named.fit, bank.runs, baseline, imperfection(bank.runs))
    frame, covariance = tables.parameters(choice.named.fit, baseline, sure)
    return Diagnosis(
        baseline=baseline, bank=bank, choice=choice, status=status, before=before, after=after,
        without=examined.without,
        likely={label: probabilities(rivals(choice, scorer, empty, label), diluted) for label in named},
        idle={label: idle(choice, label) for label in named},
        of_a_freer_form=of_a_freer_form(choice, scorer, empty),
        standing=standing, floor=floor, unsteady=examined.unsteady,
        perceived=examined.sure, sure=sure, parameters=frame, covariance=covariance,
        residuals=tables.residual_table(validate, {"baseline": before.residuals, "extended": after.residuals}),
        train=bank.runs, validate=validate, faults=faults, noisy_angles=noisy_angles,
        reversals=() if spoilt else tuple(built_up(choice.named.fit, baseline, bank.runs, validate)),
        strayed={"baseline": _strayed(empty, validate, baseline),
                 "extended": _strayed(choice.named.fit, validate, baseline)},
    )  # fmt: skip


def _dealt(motions: Sequence[Motion], cutoff_hz: float | None = None) -> tuple[tuple[Run, ...], tuple[Run, ...]]:
    listed = ", ".join(f"{m.file} ({m.run}, {m.purpose})" for m in motions) or "none"
    for purpose, why in (("train", "causes are searched there"), ("validate", "the gain is measured there")):
        if not any(m.purpose == purpose for m in motions):
            raise InputError(f"found no run to {purpose} on among: {listed}; {why}: {giving(purpose, motions)}")
    trained = {m.run for m in motions if m.purpose == "train"}
    strangers = [m.file for m in motions if m.purpose == "validate" and m.run not in trained]
    if strangers:
        raise InputError(
            f"{strangers[0]} is the only kind of run without one to train on: {listed}; "
            "record a train run of that kind, or leave it out"
        )
    runs = [observe(m, cutoff_hz) for m in motions]
    return (
        tuple(run for run in runs if run.motion.purpose == "train"),
        tuple(run for run in runs if run.motion.purpose == "validate"),
    )


def _refuse_without_floor(validate: Sequence[Run]) -> None:
    """Refuse validation runs of which too little is usable to tell noise from error."""
    if not validate:
        return
    joints = validate[0].motion.joints
    floor = noise_floor(validate, [run.measured for run in validate]).rms[: len(joints)]
    for j, joint in enumerate(joints):
        if not np.isfinite(floor[j]):
            usable = sum(int(run.usable[:, j].sum()) for run in validate)
            raise InputError(
                f"{', '.join(run.motion.file for run in validate)}: {usable} blocks away from {the(joint)}'s "
                "reversals, too few in a row to tell noise from error; validate on longer runs"
            )


def _strayed(made: Fit, validate: Sequence[Run], baseline: Baseline) -> NDArray | None:
    """Return the rms angle error of 1 s simulations over all validation runs, (J,) rad; None where none can run."""
    squares, count = 0.0, 0
    for run in validate:
        try:
            result = replay(model_of_run(made, baseline, run), run.motion)
        except (ExoidError, ZeroDivisionError):
            # Causes that the forward dynamics cannot hold together, or a mass matrix that no leg has: the torque
            # error stands all the same.
            return None
        # A model that runs away tells no error.
        with np.errstate(over="ignore"):
            squares = squares + np.sum(result.error**2, axis=(0, 1))
        count += result.error.shape[0] * result.error.shape[1]
    with np.errstate(invalid="ignore"):
        rms = np.sqrt(squares / max(count, 1))
    return rms if np.all(np.isfinite(rms)) else None


def summary_numbers(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the verdict's numbers by joint."""
    joints = diagnosis.baseline.joints

    def by_joint(values: Any) -> dict[str, float | None]:
        if values is None:
            return dict.fromkeys(joints)
        return {joint: None if v is None else float(v) for joint, v in zip(joints, values, strict=True)}

    before, after = diagnosis.before.errors, diagnosis.after.errors
    return {
        "torque_rms_nm": by_joint(diagnosis.torque_rms),
        "noise_floor_nm": by_joint(diagnosis.standing.floor),
        "baseline_rmse_nm": by_joint(before.rms),
        "extended_rmse_nm": by_joint(after.rms),
        "baseline_rmse_unmasked_nm": by_joint(before.unmasked),
        "extended_rmse_unmasked_nm": by_joint(after.unmasked),
        "baseline_simulation_rmse_rad": by_joint(diagnosis.strayed["baseline"]),
        "extended_simulation_rmse_rad": by_joint(diagnosis.strayed["extended"]),
        "unexplained": by_joint(diagnosis.standing.unexplained),
    }
