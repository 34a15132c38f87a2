"""A model: a tuple of effects with their values. Everything a stage asks of physics, it asks here."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.effects import EFFECTS, Effect, Parameter, Side
from pipelines.effects.friction import Friction
from pipelines.effects.rigid_body import RigidBody
from pipelines.errors import InputError
from pipelines.mechanics.motion import Motion

BY_NAME = {effect.name: effect for effect in EFFECTS}


@dataclass(frozen=True)
class Term:
    """An effect and the values of its parameters, linear ones first."""

    effect: Effect
    values: NDArray = field(default_factory=lambda: np.zeros(0))

    @property
    def linear(self) -> NDArray:
        """Values of the linear parameters."""
        return self.values[: len(self.effect.linear)]

    @property
    def shape(self) -> NDArray:
        """Values of the shape parameters."""
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
        """Values of the linear parameters, in the order of the regressor's columns."""
        return np.concatenate([term.linear for term in self.terms])

    def with_linear(self, values: NDArray) -> "Model":
        """Return the model with other linear parameters."""
        parts = np.split(np.asarray(values, float), np.cumsum([len(t.effect.linear) for t in self.terms])[:-1])
        terms = (Term(t.effect, np.append(part, t.shape)) for t, part in zip(self.terms, parts, strict=True))
        return Model(tuple(terms))

    def for_run(self, run: str) -> "Model":
        """Return the terms that are there in a kind of run."""
        return Model(tuple(t for t in self.terms if run in t.effect.acts_in and t.effect.run in (None, run)))

    def sensed(self, motion: Motion) -> Motion:
        """Undo what sensors did: the motion of the motors."""
        return self._corrected(motion, lambda effect: effect.side is Side.SENSOR)

    def corrected(self, motion: Motion) -> Motion:
        """Undo what sensors and transmissions did: the motion of the links."""
        return self._corrected(self.sensed(motion), lambda effect: effect.side is not Side.SENSOR)

    def _corrected(self, motion: Motion, chosen) -> Motion:
        for term in self.terms:
            if chosen(term.effect) and term.effect.explains(motion):
                motion = term.effect.corrected(motion, term.shape)
        return motion

    def regressor(self, motion: Motion) -> NDArray:
        """Torque per unit of each linear parameter, (n, J, p).

        Drive effects see the motor's motion, all others the link's.
        """
        motor, link = self.sensed(motion), self.corrected(motion)
        parts = [t.effect.columns(motor if t.effect.side is Side.DRIVE else link, t.shape) for t in self.terms]
        return np.concatenate(parts, axis=2)

    def torque(self, motion: Motion) -> NDArray:
        """Torque the drives must supply along a motion, (n, J) N·m."""
        return self.regressor(motion) @ self.linear_values


def effect_named(name: str) -> type[Effect]:
    """Look an effect up by the name that files use."""
    if name not in BY_NAME:
        raise InputError(f"there is no effect {name!r}; known are {', '.join(BY_NAME)}")
    return BY_NAME[name]


def baseline(joints: Iterable[str], runs: Iterable[str]) -> tuple[Effect, ...]:
    """Return the model every lab starts with: a rigid body for each kind of run, friction shared by all."""
    return (*(RigidBody(run=run) for run in runs), *(Friction(joint=joint) for joint in joints))


def model_from_parameters(frame: pd.DataFrame, run: str) -> Model:
    """Rebuild the model of one kind of run from a ``parameters/1`` table.

    ``run`` is a kind of run, or ``human`` for the wearer's own rigid body.
    """
    chosen = frame[frame["run"].isna() | (frame["run"] == run)]
    if not (chosen["effect"] == "rigid_body").any():
        known = ", ".join(sorted(frame["run"].dropna().unique()))
        raise InputError(f"the parameters hold no rigid body for run {run!r}, only for {known}")
    terms = []
    for (name, joint), rows in chosen.groupby(["effect", "joint"], sort=False, dropna=False):
        effect = effect_named(str(name))(joint=None if pd.isna(joint) else joint)
        values = rows.set_index("name")["value"]
        missing = [p.name for p in effect.parameters if p.name not in values.index]
        if missing:
            raise InputError(f"{effect.label}: the parameters table has no row {', '.join(missing)}")
        terms.append(Term(effect, np.array([float(values[p.name]) for p in effect.parameters])))
    return Model(tuple(terms))
