"""A model: a tuple of effects with their values. Everything a stage asks of physics, it asks here."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.effects import EFFECTS, RUNS, Effect, Parameter, Side
from pipelines.effects.friction import Friction
from pipelines.effects.rigid_body import RigidBody
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import THE_LEG, Machine
from pipelines.mechanics.motion import Motion
from pipelines.validation import closest, suggestion

BY_NAME = {effect.name: effect for effect in EFFECTS}
BASELINE = (RigidBody.name, Friction.name)
"""What every lab's model holds."""


@dataclass(frozen=True)
class Term:
    """An effect and the values of its fitted parameters, linear ones first."""

    effect: Effect
    values: NDArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        """Fill in the defaults of what was left out."""
        object.__setattr__(self, "values", self.effect.completed(self.values))

    @property
    def linear(self) -> NDArray:
        """Values of the linear parameters, (p,)."""
        return self.values[: len(self.effect.linear)]

    @property
    def shape(self) -> NDArray:
        """Values of the shape parameters, (s,)."""
        return self.values[len(self.effect.linear) :]


@dataclass(frozen=True)
class Model:
    """Terms whose torques add up, on a motion corrected for what sensors and transmissions do to it."""

    terms: tuple[Term, ...]

    def __iter__(self) -> Iterator[Term]:
        """Go through the terms."""
        return iter(self.terms)

    @property
    def linear_parameters(self) -> list[tuple[Effect, Parameter]]:
        """Effect and parameter behind each column of the regressor, in its order."""
        return [(term.effect, parameter) for term in self.terms for parameter in term.effect.linear]

    @property
    def linear_values(self) -> NDArray:
        """Values of the linear parameters, (p,) in the order of the regressor's columns."""
        return np.concatenate([term.linear for term in self.terms])

    def with_linear(self, values: NDArray) -> "Model":
        """Return the model with other linear parameters, (p,)."""
        parts = np.split(np.asarray(values, float), np.cumsum([len(t.effect.linear) for t in self.terms])[:-1])
        terms = (Term(t.effect, np.append(part, t.shape)) for t, part in zip(self.terms, parts, strict=True))
        return Model(tuple(terms))

    def for_run(self, run: str) -> "Model":
        """Return the terms that are there in a kind of run."""
        return Model(tuple(t for t in self.terms if run in t.effect.acts_in and t.effect.run in (None, run)))

    def sensed(self, motion: Motion) -> Motion:
        """Undo what encoders did: the motion of the motors."""
        return self._corrected(motion, lambda effect: effect.side is Side.SENSOR)

    def behind_motors(self, motor: Motion) -> Motion:
        """Undo what transmissions did to the motors' motion: that of the machine's links."""
        return self._corrected(motor, lambda e: e.side in (Side.DRIVE, Side.STRUCTURE))

    def behind_cuffs(self, link: Motion) -> Motion:
        """Undo what cuffs did to the links' motion: that of the wearer's limb."""
        return self._corrected(link, lambda effect: effect.side is Side.HUMAN)

    def _corrected(self, motion: Motion, chosen) -> Motion:
        for term in self.terms:
            if chosen(term.effect) and term.effect.explains(motion):
                motion = term.effect.corrected(motion, term.shape)
        return motion

    def regressor(self, motion: Motion) -> NDArray:
        """Measured torque per unit of each linear parameter, (n, J, p).

        Drive effects see the motor's motion, those on the wearer's side of the cuffs the limb's, all others the
        link's. The sensors then make of all these torques, one sensor effect after the other, what they measure.
        """
        motor = self.sensed(motion)
        link = self.behind_motors(motor)
        limb = self.behind_cuffs(link)
        parts: dict[int, NDArray] = {}
        for i in sorted(range(len(self.terms)), key=lambda i: self.terms[i].effect.side is Side.SENSOR):
            effect, shape = self.terms[i].effect, self.terms[i].shape
            at = limb if effect.on_limb else motor if effect.side is Side.DRIVE else link
            parts = {k: effect.observed(columns, motion, shape) for k, columns in parts.items()}
            parts[i] = effect.columns(at, shape)
        return np.concatenate([parts[i] for i in range(len(parts))], axis=2)

    def observed(self, columns: NDArray, motion: Motion) -> NDArray:
        """Return what the sensors make of torques (n, J, k) along a motion."""
        for term in self.terms:
            if term.effect.side is Side.SENSOR:
                columns = term.effect.observed(columns, motion, term.shape)
        return columns

    def delivered(self, motion: Motion) -> NDArray:
        """Return what the drives deliver where their sensors measured ``motion.torque``, (n, J) N·m."""
        torque = motion.torque
        for term in reversed(self.terms):
            torque = term.effect.delivered(torque, motion, term.values)
        return torque

    def torque(self, motion: Motion) -> NDArray:
        """Torque that the sensors should measure along a motion, (n, J) N·m."""
        return self.regressor(motion) @ self.linear_values


def effect_named(name: str) -> type[Effect]:
    """Look an effect up by the name that files use.

    Raises
    ------
    InputError
        Where there is none of this name.
    """
    if name not in BY_NAME:
        raise InputError(f"there is no effect {name!r}; {suggestion(name, list(BY_NAME))}")
    return BY_NAME[name]


def baseline(machine: Machine, runs: Iterable[str]) -> tuple[Effect, ...]:
    """Return the model every lab starts with: a rigid body for each kind of run, friction shared by all."""
    bodies = (RigidBody(run=run, on=machine) for run in runs)
    return (*bodies, *(Friction(joint=joint, on=machine) for joint in machine.names))


def model_from_parameters(frame: pd.DataFrame, run: str, machine: Machine = THE_LEG) -> Model:
    """Rebuild the model of one kind of run of a machine from a ``parameters/1`` table.

    ``run`` is a kind of run, or ``human`` for the wearer's own rigid body.

    Raises
    ------
    InputError
        Where the table has no rigid body for that run.
    """
    is_body = frame["effect"] == RigidBody.name
    if not (is_body & (frame["run"] == run)).any():
        known = ", ".join(sorted(frame.loc[is_body, "run"].dropna().unique()))
        raise InputError(f"the parameters hold no rigid body for run {run!r}, only for {known}")
    terms = [term for term, _ in terms_beside_bodies(frame, machine) if term.effect.run in (None, run)]
    bodies = {str(kind): rows for kind, rows in frame[is_body].groupby("run")}
    if any(term.effect.at_cuff for term in terms) and {"exo_alone", "human"} <= set(bodies):
        # Machine and limb move apart: each needs its own.
        parts = [
            (RigidBody(on=machine), bodies["exo_alone"]), (RigidBody(run="with_human", on=machine), bodies["human"]),
        ]  # fmt: skip
    else:
        parts = [(RigidBody(run=run if run in RUNS else None, on=machine), bodies[run])]
    return Model((*(_term_from_rows(effect, rows) for effect, rows in parts), *terms))


def terms_beside_bodies(frame: pd.DataFrame, machine: Machine) -> list[tuple[Term, pd.DataFrame]]:
    """Return every term that a ``parameters/1`` table of a machine has beside rigid bodies, and the rows that tell it.

    Raises
    ------
    InputError
        Where it tells of effects or joints that there are not, or not of all their values.
    """
    beside = frame[frame["effect"] != RigidBody.name]
    if (twice := beside[["effect", "joint", "run", "name"]].duplicated()).any():
        row = beside[twice].iloc[0]
        raise InputError(
            f"the parameters table: row {row.name} tells {row['name']} of {row['effect']} again, expected every value "
            "once; delete one of both rows"
        )
    others = beside.groupby(["effect", "joint", "run"], sort=False, dropna=False)
    return [(_term_from_rows(_effect_of_rows(rows, machine), rows), rows) for _, rows in others]


def _effect_of_rows(rows: pd.DataFrame, machine: Machine) -> Effect:
    """Return the effect that a parameters table tells of in some rows, all of one cause."""
    first = rows.iloc[0]
    joint, run = (first[key] if isinstance(first[key], str) else None for key in ("joint", "run"))
    of = effect_named(str(first["effect"]))
    if joint not in ([None] if of.whole_leg else machine.names):
        expected = "none: it is the whole machine's" if of.whole_leg else " or ".join(machine.names)
        raise InputError(
            f"the parameters table: {of.name} has the joint {joint or 'none'}, expected {expected}; correct its column "
            "joint, or the joints in its metadata"
        )
    each_run = bool(of.may_differ and "each_run" in rows and rows["each_run"].any())
    return of(joint=joint, run=run, on=machine, each_run=each_run)


def _term_from_rows(effect: Effect, rows: pd.DataFrame) -> Term:
    try:
        return term_from(effect, dict(zip(rows["name"], rows["value"].astype(float), strict=True)))
    except InputError as error:
        raise InputError(f"the parameters table: {error}") from None


def term_from(effect: Effect, values: Mapping[str, float]) -> Term:
    """Return a term from the values that a file gives to ``effect.parameters``.

    Raises
    ------
    InputError
        Where values are missing, or others than the effect's.
    """
    effect = effect.told_by(values)
    known = {parameter.name: parameter for parameter in effect.parameters}
    missing = [name for name, parameter in known.items() if name not in values and parameter.default is None]
    if missing or not set(values) <= set(known):
        meant = [near for name in values if name not in known and (near := closest(name, list(known)))]
        raise InputError(
            f"{effect.label} has values {', '.join(values) or 'none'}, expected {', '.join(known)}; "
            + (f"did you mean {', '.join(meant)}?" if meant else "correct them")
        )
    physical = np.array([values.get(name, parameter.default) for name, parameter in known.items()], dtype=float)
    return Term(effect, effect.values_from(physical))


def unrealizable(parameters: pd.DataFrame, machine: Machine, geometry: Geometry) -> list[str]:
    """Say why no real machine has the rigid bodies of a ``parameters/1`` table; empty when one may."""
    bodies = parameters[parameters["effect"] == RigidBody.name]
    return [
        f"{run}: {reason}"
        for run, rows in bodies.groupby("run", sort=False)
        for reason in machine.mechanism.unrealizable(rows["value"].to_numpy(float), geometry)
    ]


def upside_down(parameters: pd.DataFrame, machine: Machine) -> list[str]:
    """Say which first moments of mass of a ``parameters/1`` table lie above their axes, a sentence each.

    Empty where gravity does not act: nothing is above then. Angles count from hanging straight down. A link may be
    overbalanced, or stand; where none is, the zero or a sign is wrong, or what is taken for gravity is a spring.
    """
    if not machine.mechanism.has_gravity:
        return []
    moments = {parameter.name for parameter in machine.mechanism.parameters if parameter.unit == "kg·m"}
    of_bodies = parameters[(parameters["effect"] == RigidBody.name) & parameters["name"].isin(moments)]
    return [
        f"{row['run']}: {row['name']} = {row['value']:.3g} kg·m ({row['ci95_low']:.3g} to {row['ci95_high']:.3g}) has "
        "mass above the axis where the angle is zero, which is to be hanging straight down: unless the link is "
        "overbalanced or stands up, the zero is half a turn off, a sign is wrong, or a spring is taken for gravity"
        for row in of_bodies[of_bodies["ci95_high"] < 0.0].to_dict("records")
    ]
