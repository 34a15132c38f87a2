"""A model: a tuple of effects with their values, which every stage asks for its physics."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.effects import EFFECTS, Effect, Parameter, Side
from pipelines.errors import InputError
from pipelines.mechanics.motion import Motion
from pipelines.validation.suggestion import closest, suggestion

BY_NAME = {effect.name: effect for effect in EFFECTS}


@dataclass(frozen=True)
class Term:
    """An effect and the values of its fitted parameters, linear ones first."""

    effect: Effect
    values: NDArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        """Fill in the defaults of what was left out."""
        object.__setattr__(self, "values", self.effect.completed(self.values))

    @classmethod
    def of(cls, effect: Effect, shape: Iterable[float] = ()) -> "Term":
        """Return an effect of some shape whose linear parameters are zero."""
        return cls(effect, np.append(np.zeros(len(effect.linear)), list(shape)))

    @property
    def linear(self) -> NDArray:
        """Values of the linear parameters, (p,)."""
        return self.values[: len(self.effect.linear)]

    @property
    def shape(self) -> NDArray:
        """Values of the shape parameters, (s,)."""
        return self.values[len(self.effect.linear) :]

    def with_shape(self, i: int, value: float) -> "Term":
        """Return the term with another value of shape parameter ``i``."""
        values = self.values.copy()
        values[len(self.effect.linear) + i] = value
        return Term(self.effect, values)


class Motions(NamedTuple):
    """A measured motion, corrected for what sensors, transmissions and cuffs do to it."""

    motor: Motion
    """As the motors move: what drive effects act on."""
    link: Motion
    """As the machine's links move; the cuffs' force sensors sit on them."""
    limb: Motion
    """As the wearer's limb moves."""


@dataclass(frozen=True)
class Model:
    """Terms whose torques add up.

    They act on a motion that is corrected for what sensors and transmissions do to it.
    """

    terms: tuple[Term, ...]

    @classmethod
    def of(cls, effects: Iterable[Effect]) -> "Model":
        """Return the model of some effects whose linear parameters are zero."""
        return cls(tuple(Term.of(effect) for effect in effects))

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
        values = np.asarray(values, dtype=float)
        chosen = zip(self.terms, self._columns, strict=True)
        return Model(tuple(Term(t.effect, np.append(values[own], t.shape)) for t, own in chosen))

    @cached_property
    def _columns(self) -> list[slice]:
        """Each term's columns in the regressor."""
        ends = np.cumsum([0, *(len(term.effect.linear) for term in self.terms)]).tolist()
        return [slice(start, stop) for start, stop in itertools.pairwise(ends)]

    def for_run(self, run: str) -> "Model":
        """Return the terms that are there in a kind of run."""
        return Model(tuple(term for term in self.terms if term.effect.acts(run)))

    def motions(self, motion: Motion) -> Motions:
        """Return a measured motion as it is of the motors, the links and the wearer's limb."""
        motor = self.sensed(motion)
        link = self.behind_motors(motor)
        return Motions(motor, link, self.behind_cuffs(link))

    def sensed(self, motion: Motion) -> Motion:
        """Undo what encoders did: the motion of the motors."""
        return self._corrected(motion, lambda effect: effect.side is Side.SENSOR)

    def behind_motors(self, motor: Motion) -> Motion:
        """Undo what transmissions did to the motors' motion: that of the machine's links."""
        return self._corrected(motor, lambda e: e.side in (Side.DRIVE, Side.STRUCTURE))

    def behind_cuffs(self, link: Motion) -> Motion:
        """Undo what cuffs did to the links' motion: that of the wearer's limb."""
        return self._corrected(link, lambda effect: effect.side is Side.HUMAN)

    def _corrected(self, motion: Motion, chosen: Callable[[Effect], bool]) -> Motion:
        for term in self.terms:
            if chosen(term.effect) and term.effect.explains(motion):
                motion = term.effect.corrected(motion, term.shape)
        return motion

    def regressor(
        self,
        motion: Motion,
        *,
        cuffs: bool = False,
        motions: Motions | None = None,
    ) -> NDArray:
        """Return the measured torque per unit of each linear parameter.

        Drive effects see the motors' motion, those on the wearer's side of the cuffs the limb's,
        all others the links'. The torque sensors then make of all these torques, one sensor effect
        after the other, what they measure.

        Parameters
        ----------
        motion : Motion
            As it was measured, n samples of J joints.
        cuffs : bool
            Whether rows for the torque that the cuffs measure follow those for the drives.
        motions : Motions, optional
            ``self.motions(motion)``, for a caller that has them.

        Returns
        -------
        NDArray
            (n, J, p) N·m per unit, (n, 2 J, p) with the cuffs' rows.
        """
        motor, link, limb = motions or self.motions(motion)
        n, joints = motion.q.shape
        out = np.zeros((n, 2 * joints if cuffs else joints, len(self.linear_parameters)))
        drives = out[:, :joints]
        terms = zip(self.terms, self._columns, strict=True)
        for term, own in sorted(terms, key=lambda one: one[0].effect.side is Side.SENSOR):
            effect, shape = term.effect, term.shape
            if not effect.explains(motion):
                continue
            at = limb if effect.on_limb else motor if effect.side is Side.DRIVE else link
            # Columns that are still to come are in there too: they are written over.
            measured = effect.observed(drives, motion, shape)
            if measured is not drives:
                drives[:] = measured
            drives[:, :, own] = columns = _known_columns(effect, at, shape)
            in_cuffs = effect.cuff_columns(at, columns) if cuffs else None
            if in_cuffs is not None:
                out[:, joints:, own] = in_cuffs
        return out

    def observed(self, columns: NDArray, motion: Motion) -> NDArray:
        """Return what the sensors make of torques (n, J, k) along a motion."""
        for term in self.terms:
            if term.effect.side is Side.SENSOR:
                columns = term.effect.observed(columns, motion, term.shape)
        return columns

    def delivered(self, motion: Motion) -> NDArray:
        """Return what drives deliver where sensors measured ``motion.torque``, (n, J) N·m."""
        torque = motion.torque
        for term in reversed(self.terms):
            torque = term.effect.delivered(torque, motion, term.values)
        return torque

    def torque(self, motion: Motion) -> NDArray:
        """Torque that the sensors should measure along a motion, (n, J) N·m."""
        return self.regressor(motion) @ self.linear_values


def _known_columns(effect: Effect, motion: Motion, shape: NDArray) -> NDArray:
    """Return an effect's columns along a motion, (n, J, k).

    Friction, and what else depends on the motion alone, is the same in each of the thousand fits of
    one motion, so it is computed once. Rigid bodies mostly move otherwise than the motors, in each
    fit anew.
    """
    if effect.shape or effect.reads_load or effect.inertial:
        return effect.columns(motion, shape)
    if effect not in motion.columns_known:
        motion.columns_known[effect] = columns = effect.columns(motion, shape)
        columns.flags.writeable = False
    return motion.columns_known[effect]


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


def term_from(effect: Effect, values: Mapping[str, float]) -> Term:
    """Return a term from the values that a file gives to ``effect.parameters``.

    Raises
    ------
    InputError
        Where values are missing, or others than the effect's.
    """
    effect = effect.with_parts_named(values)
    known = {parameter.name: parameter for parameter in effect.parameters}
    missing = [
        name
        for name, parameter in known.items()
        if name not in values and parameter.default is None
    ]
    if missing or not set(values) <= set(known):
        meant = [
            near for name in values if name not in known and (near := closest(name, list(known)))
        ]
        raise InputError(
            f"{effect.label} has values {', '.join(values) or 'none'}, expected"
            f" {', '.join(known)}; "
            + (f"did you mean {', '.join(meant)}?" if meant else "correct them")
        )
    physical = np.array(
        [values.get(name, parameter.default) for name, parameter in known.items()], dtype=float
    )
    return Term(effect, effect.values_from(physical))
