"""A model: effects with values, from which every stage computes torques."""

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
        """Fill in the defaults of missing values."""
        object.__setattr__(self, "values", self.effect.completed(self.values))

    @classmethod
    def of(cls, effect: Effect, shape: Iterable[float] = ()) -> "Term":
        """Return an effect with linear parameters of zero.

        Parameters
        ----------
        effect : Effect
            The effect.
        shape : iterable of float, optional
            Its shape values, in their units.
        """
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
        """Return the term with another value of one shape parameter.

        Parameters
        ----------
        i : int
            Number of the shape parameter.
        value : float
            In the parameter's unit.
        """
        values = self.values.copy()
        values[len(self.effect.linear) + i] = value
        return Term(self.effect, values)


class Motions(NamedTuple):
    """A measured motion, corrected for sensors, transmissions and cuffs."""

    motor: Motion
    """Motion of the motors, on which drive effects act."""
    link: Motion
    """Motion of the machine's links, to which the cuffs' force sensors are fixed."""
    limb: Motion
    """Motion of the wearer's limb."""


@dataclass(frozen=True)
class Model:
    """Terms whose torques add up, on a motion corrected for sensors and transmissions."""

    terms: tuple[Term, ...]

    @classmethod
    def of(cls, effects: Iterable[Effect]) -> "Model":
        """Return the model of some effects with linear parameters of zero."""
        return cls(tuple(Term.of(effect) for effect in effects))

    def __iter__(self) -> Iterator[Term]:
        """Iterate over the terms."""
        return iter(self.terms)

    @property
    def linear_parameters(self) -> list[tuple[Effect, Parameter]]:
        """Effect and parameter of each column of the regressor, in its order."""
        return [(term.effect, parameter) for term in self.terms for parameter in term.effect.linear]

    @property
    def linear_values(self) -> NDArray:
        """Values of the linear parameters, (p,) in the order of the regressor's columns."""
        return np.concatenate([term.linear for term in self.terms])

    def with_linear(self, values: NDArray) -> "Model":
        """Return the model with other linear parameters.

        Parameters
        ----------
        values : (p,) array
            In the order of the regressor's columns, SI units.
        """
        values = np.asarray(values, dtype=float)
        chosen = zip(self.terms, self._columns, strict=True)
        return Model(tuple(Term(t.effect, np.append(values[own], t.shape)) for t, own in chosen))

    @cached_property
    def _columns(self) -> list[slice]:
        """Columns of each term in the regressor."""
        ends = np.cumsum([0, *(len(term.effect.linear) for term in self.terms)]).tolist()
        return [slice(start, stop) for start, stop in itertools.pairwise(ends)]

    def for_run(self, run: str) -> "Model":
        """Return the model of the terms that act in a kind of run."""
        return Model(tuple(term for term in self.terms if term.effect.acts(run)))

    def motions(self, motion: Motion) -> Motions:
        """Return a measured motion as motors, links and the wearer's limb perform it.

        Parameters
        ----------
        motion : Motion
            n samples as the sensors measured them.

        Returns
        -------
        Motions
            Three motions of n samples.
        """
        # From the encoders towards the wearer, because each correction needs the one before.
        motor = self.sensed(motion)
        link = self.behind_motors(motor)
        return Motions(motor, link, self._corrected(link, lambda e: e.side is Side.HUMAN))

    def sensed(self, motion: Motion) -> Motion:
        """Undo the encoders' errors: return the motion of the motors."""
        return self._corrected(motion, lambda effect: effect.side is Side.SENSOR)

    def behind_motors(self, motor: Motion) -> Motion:
        """Return the motion of the machine's links for a motion of its motors."""
        # STRUCTURE has the tilt of the base, which turns links and not motors.
        return self._corrected(motor, lambda e: e.side in (Side.DRIVE, Side.STRUCTURE))

    def _corrected(self, motion: Motion, chosen: Callable[[Effect], bool]) -> Motion:
        for term in self.terms:
            if chosen(term.effect) and term.effect.explains(motion):
                # Each correction continues from the one before, in the order of the terms.
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

        Drive effects see the motors' motion, effects on the wearer's side of the cuffs the limb's,
        and all others the links'. The torque sensors then act on the sum of all these torques, one
        sensor effect after the other.

        Parameters
        ----------
        motion : Motion
            Measured motion, n samples of J joints.
        cuffs : bool
            Whether to append rows for the torque that the cuffs measure.
        motions : Motions, optional
            ``self.motions(motion)``, if the caller has it already.

        Returns
        -------
        (n, J, p) array
            Torque in N·m per unit of each parameter; (n, 2 J, p) with the cuffs' rows.
        """
        motor, link, limb = motions or self.motions(motion)
        n, joints = motion.q.shape
        out = np.zeros((n, 2 * joints if cuffs else joints, len(self.linear_parameters)))
        drives = out[:, :joints]
        terms = zip(self.terms, self._columns, strict=True)
        # The sort is stable: torque sensors come last, and keep their order in the model.
        for term, own in sorted(terms, key=lambda one: one[0].effect.side is Side.SENSOR):
            effect, shape = term.effect, term.shape
            if not effect.explains(motion):
                continue
            at = limb if effect.on_limb else motor if effect.side is Side.DRIVE else link
            # This includes columns of later terms; they are overwritten.
            measured = effect.observed(drives, motion, shape)
            if measured is not drives:
                drives[:] = measured
            drives[:, :, own] = columns = _known_columns(effect, at, shape)
            # The cuffs lie between links and limb, so that only the limb's effects reach them.
            in_cuffs = effect.cuff_columns(at, columns) if cuffs else None
            if in_cuffs is not None:
                out[:, joints:, own] = in_cuffs
        return out

    def observed(self, columns: NDArray, motion: Motion) -> NDArray:
        """Return the torques that the sensors report.

        Parameters
        ----------
        columns : (n, J, k) array
            Torques, or torque per unit of k parameters.
        motion : Motion
            Motion of n samples.

        Returns
        -------
        (n, J, k) array
            The same after all sensor effects.
        """
        for term in self.terms:
            if term.effect.side is Side.SENSOR:
                columns = term.effect.observed(columns, motion, term.shape)
        return columns

    def delivered(self, motion: Motion) -> NDArray:
        """Return the drives' true torque.

        Parameters
        ----------
        motion : Motion
            n samples of J joints; ``motion.torque`` is the sensors' torque.

        Returns
        -------
        (n, J) array
            N·m.
        """
        torque = motion.torque
        # Readings are undone in the opposite order of that in which they arise.
        for term in reversed(self.terms):
            torque = term.effect.delivered(torque, motion, term.values)
        return torque

    def torque(self, motion: Motion) -> NDArray:
        """Return the torque that the sensors should measure along a motion.

        Parameters
        ----------
        motion : Motion
            n samples of J joints.

        Returns
        -------
        (n, J) array
            N·m.
        """
        return self.regressor(motion) @ self.linear_values


def _known_columns(effect: Effect, motion: Motion, shape: NDArray) -> NDArray:
    """Return an effect's columns along a motion, (n, J, k).

    Columns that do not depend on the loads are kept with the motion until the effect's shape is
    another.
    """
    # Mostly, rigid bodies move differently from the motors, and that motion is new in each fit.
    if effect.reads_load or effect.inertial:
        return effect.columns(motion, shape)
    # A diagnosis fits the same motion a thousand times, and moves one shape at a time.
    at = tuple(shape)
    known = motion.columns_known.get(effect)
    if known is None or known[0] != at:
        known = motion.columns_known[effect] = at, effect.columns(motion, shape)
        # Many fits share the array, and none of them may change it.
        known[1].flags.writeable = False
    return known[1]


def effect_named(name: str) -> type[Effect]:
    """Return the effect of a name, as files spell it.

    Raises
    ------
    InputError
        If no effect has this name.
    """
    if name not in BY_NAME:
        raise InputError(f"there is no effect {name!r}; {suggestion(name, list(BY_NAME))}")
    return BY_NAME[name]


def term_from(effect: Effect, values: Mapping[str, float]) -> Term:
    """Build a term from the values of ``effect.parameters`` in a file.

    Raises
    ------
    InputError
        If values are missing, or belong to no parameter of the effect.
    """
    # The number of a ripple's lines follows from the names in the file.
    effect = effect.with_parts_named(values)
    defaults = {parameter.name: parameter.default for parameter in effect.parameters}
    known = list(defaults)
    given = {**{name: d for name, d in defaults.items() if d is not None}, **values}
    if set(given) != set(known):
        unknown = [name for name in values if name not in known]
        meant = list(filter(None, (closest(name, known) for name in unknown)))
        raise InputError(
            f"{effect.label} has values {', '.join(values) or 'none'}, expected"
            f" {', '.join(known)}; "
            + (f"did you mean {', '.join(meant)}?" if meant else "correct them")
        )
    # Files may hold other parameters than a fit, such as amplitude and phase.
    physical = np.array([given[name] for name in known], dtype=float)
    return Term(effect, effect.values_from(physical))
