"""The interface of an effect: one physical phenomenon, with its equation written once.

An effect acts through the hooks that it defines:

==================  ===========================================================
``reaction``        torque the drives must supply; linear in ``linear``, any function of ``shape``
``derivative``      rate of the memory (``states`` of it) that ``reaction`` reads
``spring``          torque across a joint that is not rigid
``reading``         angles that the encoders report for true angles
``torque_reading``  torques that the torque sensors report for true torques
``corrected``       the inverse of ``spring`` or ``reading`` for a measured motion
==================  ===========================================================

Identification and diagnosis use ``columns``, ``observed`` and ``corrected``; the forward dynamics
uses the compiled hooks. ``columns`` and ``observed`` evaluate the same kernels, so the two cannot
disagree.
"""

from abc import ABC
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum, IntEnum, StrEnum
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joint_units import Scale, refuse_unknown_unit, unit_at
from pipelines.contracts.joints import Joint
from pipelines.effects.kernel import address, columns_along, columns_along_with_memory, read_along
from pipelines.mechanics.machine import THE_LEG, Machine
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.run import RUNS


class Side(StrEnum):
    """Where an effect acts."""

    DRIVE = "drive"
    STRUCTURE = "structure"
    SENSOR = "sensor"
    HUMAN = "human"


class Family(StrEnum):
    """The kind of law that an effect follows, in words that need no catalogue."""

    ANGLE = "angle"
    SPEED = "speed"
    REVERSAL = "reversal"
    LOAD = "load"
    TIME = "time"
    TRANSMISSION = "transmission"
    SENSOR = "sensor"
    PERSON = "person"


class Parity(IntEnum):
    """Sign of a torque when the same path is traversed backwards in time."""

    EVEN = 1
    ODD = -1


class Element(Enum):
    """An element of simulators' model formats.

    An effect with its equation has its values, in the same order. A spring has its rest angle, as
    in ``physical``.
    """

    RIGID_BODIES = "inertial parameters of the mechanism"
    FRICTION = "Coulomb and viscous friction of a joint"
    QUADRATIC_DAMPING = "torque of a joint per squared speed"
    ARMATURE = "inertia of a joint's rotor"
    SPRING = "stiffness and rest angle of a spring across a joint"
    MASS_ACROSS = "first moment of mass across a link"
    SERIES_SPRING = "stiffness and hardening of a spring between motor and link"
    TORQUE_GAIN = "measured torque per torque of a joint"
    TORQUE_OFFSET = "measured less true torque of a joint"


@dataclass(frozen=True)
class Tie:
    """Why recordings cannot separate two causes, and how to separate them."""

    why: str
    how_to_separate: str


@dataclass(frozen=True)
class Parameter:
    """One number of an effect."""

    name: str
    unit: str
    meaning: str
    symbol: str
    typical: tuple[float, float]
    """Range on exoskeletons; a search for a shape parameter spans it."""
    per_run: bool = False
    """True if each run has a value of its own, such as an onset time."""
    default: float | None = None
    """Default value; a shape parameter that has one may be held in a fit."""
    forms: tuple[float, ...] = ()
    """Values of the known members of a family of shapes; empty if there is only the
    range."""
    between_forms: bool = True
    """False if only the forms exist, as for a sign or a switch."""
    grain: float = 1.0
    """Step of a search along an oscillating effect."""
    swept: bool = False
    """True for a position of the joint: a search then spans the motion's range, not ``typical``."""
    swept_end: int = 0
    """-1 or 1 for the lower or upper end of the joint's positions in the training runs, at which
    every fit holds it; 0 if it is neither."""
    of_joint: bool = True
    """False if its unit does not depend on the joint: a phase is an angle at a prismatic joint
    too."""

    def __post_init__(self) -> None:
        if self.of_joint:
            refuse_unknown_unit(self.name, self.unit)

    @property
    def neutral(self) -> float:
        """Value at which its effect vanishes; for a stiffness, the end that it never reaches."""
        return 1.0 if self.unit == "1" and self.typical[0] > 0 else 0.0

    @property
    def by_factors(self) -> bool:
        """Whether it varies by factors: its typical range is positive and wide."""
        low, high = self.typical
        return low > 0.0 and high / low > 4.0

    def off_middle(self, value: float) -> float:
        """Return the distance of a value from the middle of the typical range.

        Parameters
        ----------
        value : float
            In the parameter's unit.

        Returns
        -------
        float
            In half ranges, of logarithms for a parameter that varies by factors.
        """
        ends = np.array([*self.typical, value])
        # A value may be zero, which has no logarithm.
        low, high, at = np.log(np.maximum(ends, np.finfo(float).tiny)) if self.by_factors else ends
        return float((2.0 * at - low - high) / (high - low))

    def at(self, machine: Machine, joint: str) -> "Parameter":
        """Return the parameter with unit and ranges of a joint of a machine.

        Parameters
        ----------
        machine : Machine
            With the scale of each joint.
        joint : str
            Name of the joint.
        """
        if not self.of_joint:
            return self
        scale, (low, high) = machine.scale(joint).of(self.unit), self.typical
        return replace(
            self,
            unit=unit_at(machine.joint(joint).kind, self.unit),
            typical=(scale * low, scale * high),
            default=None if self.default is None else scale * self.default,
            forms=tuple(scale * form for form in self.forms),
            grain=scale * self.grain,
        )


@dataclass(frozen=True)
class Effect(ABC):
    """A physical effect, bound to a joint and optionally to one kind of run."""

    joint: str | None = None
    """Joint at which it acts; None for an effect of the whole leg."""
    run: str | None = None
    """The only kind of run in which it acts; None for all in ``acts_in``."""
    on: Machine = THE_LEG
    """Machine that has it."""
    each_run: bool = False
    """True if its values differ from run to run; only for effects that ``may_differ``."""

    name: ClassVar[str]
    title: ClassVar[str]
    side: ClassVar[Side]
    equation: ClassVar[str]
    source: ClassVar[str]
    looks_like: ClassVar[str]
    """Its signature in a plot of the residual."""
    confirm: ClassVar[str]
    """Instructions to confirm it on the rig."""
    family: ClassVar[Family]
    """Kind of law that it follows; by default that of its side (``FAMILY_OF_SIDE``)."""
    any_form: ClassVar[str] = ""
    """Smooth law that equals this effect whatever its form; empty if only similar forms do."""
    resembles: ClassVar[tuple[str, ...]]
    """Smooth laws of its joint that contain it approximately (``wording/law.py``). A verdict
    reports such a law if the real effect is too far from the equation. By default those of its
    family (``LAWS_OF_FAMILY``)."""
    forms_differ: ClassVar[str] = ""
    """How the real effect may differ from the equation: a sentence without its full stop, or
    empty."""
    ties: ClassVar[Mapping[str, Tie]] = {}
    """Effects that data of some kind can never separate from it, by name; ``torque_gain`` of one
    joint is tied with that of another. One of two tied effects lists the other."""
    cuff_coherence: ClassVar[str] = ""
    """Sentence on the coherence of cuff forces and drive torques, if that is evidence for it."""
    reversal_travel: ClassVar[str] = ""
    """What takes up a travel while friction changes sign at a reversal, in words; empty if nothing
    does."""
    order_tracked: ClassVar[bool] = False
    """True if order tracking finds its lines over the joint's angle. Each of its shapes is then the
    number of cycles a turn of one line."""
    most_parts: ClassVar[int] = 1
    """Largest number of parts (``with_parts``)."""
    may_be_worn: ClassVar[bool] = False
    """True if the wearer may carry it instead of the machine: then it acts in their runs only, and
    the cuffs measure it."""
    element: ClassVar[Element | None] = None
    """Element of simulators' model formats that has its equation; None if there is none."""
    joints: ClassVar[tuple[str, ...] | None] = None
    """The only joints that can have it, by their place in the mechanism; None for any."""
    absorbed: ClassVar[Mapping[str, str]] = {}
    """By the place of a joint, the other parameter that absorbs it completely there."""
    absorbed_as: ClassVar[str] = ""
    """Kind of torque that a mechanism's parameters may absorb completely (``Mechanism.absorbs``);
    empty if none can."""
    mechanism_equation: ClassVar[str] = ""
    """Key of its equation in ``Mechanism.reactions``; empty if it is the same for all
    mechanisms."""
    needs_temperature: ClassVar[bool] = False
    """True if it acts only in runs whose motor temperature was measured."""
    by_angle: ClassVar[bool] = False
    """True if it shows only in a torque that depends on the joint's position, such as gravity's.
    For the whole machine, the first joint counts."""
    holds: ClassVar[bool] = False
    """True if it increases the torque that can hold a joint at rest."""
    needs_torque: ClassVar[bool] = False
    """True if it shows only in a drive's torque: a passive joint does not have it."""
    limits_travel: ClassVar[bool] = False
    """True if no joint that turns without end can have it: a spring or a stop, or an equation
    between two ends of the travel."""
    whole_leg: ClassVar[bool] = False
    acts_in: ClassVar[tuple[str, ...]] = RUNS
    linear: ClassVar[tuple[Parameter, ...]] = ()
    """Amplitudes, in the form that a fit solves for."""
    shape: ClassVar[tuple[Parameter, ...]] = ()
    """Parameters of which the torque is a nonlinear function; those with a default come last."""
    reported: ClassVar[tuple[Parameter, ...] | None] = None
    """Parameters in files, if they differ from those of a fit, such as amplitude and phase instead
    of sine and cosine."""

    parity: ClassVar[Parity | None] = None
    """Parity of the torque in velocity; None if it has none, or has a memory."""
    dissipative: ClassVar[bool] = False
    """True if positive amplitudes never feed energy into the joint."""
    states: ClassVar[int] = 0
    inertial: ClassVar[bool] = False
    """True if ``reaction`` depends on acceleration, and so adds to the mass matrix."""
    motor_inertia: ClassVar[float] = 0.0
    """kg·m² on the motor's side of ``spring``."""
    damping_ratio: ClassVar[float] = 0.0
    """Damping ratio of ``motor_inertia`` on ``spring``, if the spring is linear."""
    exoskeleton_only: ClassVar[bool] = False
    """True if ``spring`` can only be simulated for an exoskeleton's joints."""
    known_to: ClassVar[float] = 0.0
    """Relative standard error of its first shape parameter due to the effect's own
    approximations."""
    may_differ: ClassVar[str] = ""
    """The thing that is set at every start, so that each run may have another value; empty if all
    runs share one."""
    at_cuff: ClassVar[bool] = False
    """True if ``spring`` lies between machine and limb, not between motor and link."""
    swings: ClassVar[bool] = False
    """True if ``corrected`` lets the load swing on the spring, so that its motion depends on
    frequency."""
    reads_load: ClassVar[bool] = False
    """True if ``reaction`` depends on the transmitted torque.

    Along a measured motion, that torque must be smoothed. The columns of other effects are computed
    once for motions that differ in their loads alone.
    """
    reading_states: ClassVar[int] = 0
    reaction: ClassVar[Callable[..., Any] | None] = None
    derivative: ClassVar[Callable[..., Any] | None] = None
    spring: ClassVar[Callable[..., Any] | None] = None
    reading: ClassVar[Callable[..., Any] | None] = None
    torque_reading: ClassVar[Callable[..., Any] | None] = None

    def __init_subclass__(cls, **options: Any) -> None:
        """Fill in the family and the laws that the class does not define."""
        super().__init_subclass__(**options)
        side = getattr(cls, "side", None)
        # Without a side there is no default. An installed effect that lacks one is refused later.
        if side is None:
            return
        family_of = {
            Side.DRIVE: Family.SPEED,
            Side.STRUCTURE: Family.ANGLE,
            Side.SENSOR: Family.SENSOR,
            Side.HUMAN: Family.PERSON,
        }
        laws_of: dict[Family, tuple[str, ...]] = {
            Family.ANGLE: ("angle", "both_angles"),
            Family.SPEED: ("speed",),
            Family.REVERSAL: ("speed", "friction_by_angle"),
            Family.LOAD: ("load", "speed"),
            Family.TIME: ("time", "friction_over_time"),
            Family.TRANSMISSION: ("angle", "speed", "load", "inertia_by_angle"),
            Family.SENSOR: ("angle", "load"),
            Family.PERSON: ("angle", "both_angles", "speed"),
        }
        if not hasattr(cls, "family"):
            cls.family = family_of[side]
        if not hasattr(cls, "resembles"):
            cls.resembles = laws_of[cls.family]

    def __post_init__(self) -> None:
        """Adapt units and equations to the machine, and mark parameters that differ by run."""
        # Effects are frozen, so that what depends on the machine is set past the dataclass.
        if self.each_run:
            for role in ("linear", "shape"):
                object.__setattr__(
                    self, role, tuple(replace(p, per_run=True) for p in getattr(type(self), role))
                )
        # Ranges, units and equations of the classes are those of the leg.
        if self.on == THE_LEG:
            return
        if self.joint:
            for role in ("linear", "shape", "reported"):
                declared = getattr(self, role)
                scaled = declared and tuple(p.at(self.on, self.joint) for p in declared)
                object.__setattr__(self, role, scaled)
        if self.mechanism_equation:
            # None for a mechanism without such an equation, on which the effect is not possible.
            reaction = self.on.mechanism.reactions.get(self.mechanism_equation)
            object.__setattr__(self, "reaction", reaction)

    @classmethod
    def possible(cls, machine: Machine) -> list[str | None]:
        """Return the joints of a machine that can have the effect and show it.

        Parameters
        ----------
        machine : Machine
            Any machine.

        Returns
        -------
        list
            Names of joints; ``[None]`` if it belongs to the whole machine.
        """
        mechanism = machine.mechanism
        if cls.absorbed_as in machine.absorbs:
            return []
        if cls.mechanism_equation and cls.mechanism_equation not in mechanism.reactions:
            return []
        if cls.joints is not None and not set(cls.joints) & set(mechanism.places):
            return []
        shows_at = mechanism.bends_at if cls.by_angle else mechanism.places
        if cls.whole_leg:
            return [None] if mechanism.places[0] in shows_at else []
        places = dict(zip(machine.names, mechanism.places, strict=True))
        return [
            name
            for name, place in places.items()
            if place in shows_at
            and (cls.joints is None or place in cls.joints)
            and place not in cls.absorbed
            and cls._fits(machine.joint(name))
        ]

    @classmethod
    def _fits(cls, joint: Joint) -> bool:
        """Return whether a joint with such a drive and travel can have it."""
        lacks_torque = cls.needs_torque and not joint.has_sensor
        return not (lacks_torque or (cls.limits_travel and joint.turns))

    @property
    def scale(self) -> Scale:
        """Scale of its joint relative to an exoskeleton's."""
        return self.on.scale(self.joint) if self.joint else Scale()

    @property
    def fitted(self) -> tuple[Parameter, ...]:
        """Linear, then shape parameters: the order of a term's values everywhere."""
        return self.linear + self.shape

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters as files and reports name them."""
        return self.fitted if self.reported is None else self.reported

    @property
    def label(self) -> str:
        """``effect@joint``, as in tables of candidates."""
        return f"{self.name}@{self.joint}" if self.joint else self.name

    @property
    def per_run(self) -> bool:
        """Whether some value differs from run to run, such as an onset or a phase."""
        return any(p.per_run for p in self.fitted)

    @property
    def depends_on_time(self) -> bool:
        """Whether the torque depends on wall time, as that of a rhythm or a drift does."""
        return self.per_run and not self.each_run

    @property
    def sized_each_run(self) -> bool:
        """Whether the size differs from run to run, so that no run predicts another's."""
        return self.each_run or any(p.per_run for p in self.linear)

    @property
    def on_limb(self) -> bool:
        """Whether it acts on the wearer's side of the cuffs."""
        return self.side is Side.HUMAN or self.run == "with_human"

    def explains(self, motion: Motion) -> bool:
        """Return whether the effect acts in this run, with all measurements that it depends on."""
        known = not self.needs_temperature or bool(
            np.isfinite(motion.interpolated_temperature[:, self.column(motion)]).all()
        )
        return known and self.acts(motion.run)

    def shows_in(self, motions: Sequence[Motion]) -> bool:
        """Return whether runs hold the measurements that the effect depends on."""
        if self.needs_temperature and not self.temperature_varies(
            [m for m in motions if self.acts(m.run)]
        ):
            return False
        return any(self.explains(motion) for motion in motions)

    def temperature_varies(self, motions: Sequence[Motion]) -> bool:
        """Return whether every run has its motor's temperature, and the temperatures vary."""
        # Least change of a motor's temperature, °C, from which a dependence on it can be fitted.
        least_warming_c = 1.0
        # Over all runs together: each may be steady, one cold and another warm.
        read = [motion.interpolated_temperature[:, self.column(motion)] for motion in motions]
        ends = np.array([(np.min(t), np.max(t)) for t in read if len(t)])
        # Missing temperatures are NaN, and the comparison is then false.
        return len(ends) > 0 and bool(np.ptp(ends) >= least_warming_c)

    def directions(self, motions: Sequence[Motion]) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Return shapes for which the effect is linear.

        The effect of any combination is the same combination of the columns, so that no grid of
        shapes must be searched.

        Parameters
        ----------
        motions : sequence of Motion
            Runs, whose measurements decide which directions show.

        Returns
        -------
        tuple
            Sets of shapes (s,); each set is a candidate with one column per shape. Empty if the
            effect is not linear.
        """
        return ()

    def acts(self, kind: str) -> bool:
        """Return whether the effect acts in a kind of run."""
        return kind in self.acts_in and self.run in (None, kind)

    def column(self, motion: Motion) -> int:
        """Return the column of its joint in a motion's arrays, -1 for the whole leg."""
        return motion.joint_index(self.joint) if self.joint else -1

    def physical(self, values: NDArray) -> NDArray:
        """Return the values of ``parameters``.

        Parameters
        ----------
        values : (p,) array
            Values of ``fitted``.

        Returns
        -------
        (p,) array
            In the units of ``parameters``.
        """
        return np.asarray(values, dtype=float)

    def values_from(self, physical: NDArray) -> NDArray:
        """Return the values of ``fitted``, the inverse of ``physical``.

        Parameters
        ----------
        physical : (p,) array
            Values of ``parameters``.

        Returns
        -------
        (p,) array
            In the units of ``fitted``.
        """
        return np.asarray(physical, dtype=float)

    def jacobian(self, values: NDArray) -> NDArray:
        """Return the derivative of ``physical``.

        Parameters
        ----------
        values : (fitted,) array
            Where to differentiate.

        Returns
        -------
        (parameters, fitted) array
            By central differences, unless ``physical`` is the identity.
        """
        # Relative step of numerical derivatives.
        difference = 1e-6
        values = np.asarray(values, dtype=float)
        if type(self).physical is Effect.physical:
            return np.eye(len(values))
        steps = np.diag(difference * np.maximum(np.abs(values), difference))
        ahead = np.array([self.physical(values + step) for step in steps])
        behind = np.array([self.physical(values - step) for step in steps])
        return ((ahead - behind) / (2.0 * np.diag(steps)[:, np.newaxis])).T

    def with_parts(self, number: int) -> "Effect":
        """Return the effect with a number of parts, such as lines of a ripple; most have one."""
        return self

    def with_parts_named(self, names: Collection[str]) -> "Effect":
        """Return the effect with as many parts as the names of its values require."""
        return self

    def completed(self, values: NDArray | tuple[float, ...]) -> NDArray:
        """Return values with defaults for those missing at the end.

        Parameters
        ----------
        values : (k,) array or tuple of float
            The first values of ``fitted``.

        Returns
        -------
        (p,) array
            Values of all of ``fitted``.
        """
        rest = [p.default for p in self.fitted[len(values) :]]
        return np.append(np.asarray(values, dtype=float), [d for d in rest if d is not None])

    def columns(self, motion: Motion, shape: NDArray | tuple[float, ...] = ()) -> NDArray:
        """Return the effect's part of the measured torque per unit of each linear parameter.

        Parameters
        ----------
        motion : Motion
            Motion of n samples and J joints.
        shape : (s,) array
            Shape values in this run, in the order of ``self.shape``.

        Returns
        -------
        (n, J, p) array
            N·m per unit of each linear parameter.
        """
        columns = np.zeros((*motion.q.shape, len(self.linear)))
        if not self.linear or not self.explains(motion):
            return columns
        # Amplitudes are zero here, and one at a time is set to 1.
        values = self.completed(np.append(np.zeros(len(self.linear)), shape))
        if self.torque_reading is not None:
            # A sensor's answer to no torque, per unit of each amplitude: an offset, a drift.
            for i, unit in enumerate(np.eye(len(values))[: len(self.linear)]):
                columns[:, :, i : i + 1] = self._read(
                    columns[:, :, i : i + 1], motion, values + unit
                )
        elif self.reaction is not None:
            self._react(motion, values, columns)
        return columns

    def _react(self, motion: Motion, values: NDArray, out: NDArray) -> None:
        # Only few equations read the load; for all others its smoothing would be wasted.
        load = motion.transmitted[0] if self.reads_load else np.zeros_like(motion.q)
        temperature = motion.interpolated_temperature
        of_motion = motion.time, motion.q, motion.dq, motion.ddq, load, temperature
        arrays = [np.ascontiguousarray(array) for array in of_motion]
        fixed, joints = (values, self.column(motion)), len(motion.joints)
        reaction, geometry = address(self.reaction), motion.geometry.array()
        if self.derivative is None:
            columns_along(reaction, *fixed, *arrays, geometry, np.zeros(2 * joints), out)
            return
        # After a gap the memory is unknown, and settles again.
        for stretch in motion.segments():
            parts = (array[stretch] for array in arrays)
            scratch, memory = np.zeros((11, joints)), np.zeros((3, self.states))
            kernels = reaction, address(self.derivative)
            columns_along_with_memory(
                *kernels, *fixed, *parts, geometry, scratch, memory, out[stretch]
            )

    def torque(self, motion: Motion, values: NDArray) -> NDArray:
        """Return the effect's part of the measured torque.

        Parameters
        ----------
        motion : Motion
            Motion of n samples and J joints.
        values : (p + s,) array
            Linear, then shape values.

        Returns
        -------
        (n, J) array
            N·m.
        """
        linear, shape = np.split(np.asarray(values, dtype=float), [len(self.linear)])
        return self.columns(motion, shape) @ linear

    def cuff_columns(self, motion: Motion, columns: NDArray) -> NDArray | None:
        """Return the torque that the cuffs measure of the effect, per unit of each parameter.

        Parameters
        ----------
        motion : Motion
            Motion of n samples and J joints.
        columns : (n, J, p) array
            Torque that the drives measure along the same motion.

        Returns
        -------
        (n, J, p) array or None
            None for an effect on the machine's side of the cuffs, which they do not measure.
        """
        return columns if self.on_limb else None

    def observed(
        self, columns: NDArray, motion: Motion, shape: NDArray | tuple[float, ...] = ()
    ) -> NDArray:
        """Return the torques that the torque sensors report, without the effect's own ``columns``.

        Parameters
        ----------
        columns : (n, J, p) array
            Torques that the drives deliver.
        motion : Motion
            Motion of n samples and J joints.
        shape : (s,) array
            Shape values in this run.

        Returns
        -------
        (n, J, p) array
            Reported torques.
        """
        # Without a shape, a sensor only adds its own columns, and passes all others on.
        if self.torque_reading is None or not self.shape or not self.explains(motion):
            return columns
        return self._read(
            columns, motion, self.completed(np.append(np.zeros(len(self.linear)), shape))
        )

    def _read(self, torque: NDArray, motion: Motion, values: NDArray) -> NDArray:
        out = np.empty_like(torque)
        sensor = address(self.torque_reading), values, self.column(motion)
        time = np.ascontiguousarray(motion.time)
        temperature = np.ascontiguousarray(motion.interpolated_temperature)
        # A sensor's memory does not reach across a gap.
        for s in motion.segments():
            # A memory for each torque, because the columns pass the sensor independently.
            memory = np.zeros((torque.shape[2], self.reading_states))
            at_once = np.zeros(len(motion.joints))
            read_along(*sensor, time[s], temperature[s], torque[s], at_once, memory, out[s])
        return out

    def delivered(self, torque: NDArray, motion: Motion, values: NDArray) -> NDArray:
        """Return the torques that the drives deliver: the inverse of the sensors' reading.

        Parameters
        ----------
        torque : (n, J) array
            Reported torques, N·m.
        motion : Motion
            Motion of n samples.
        values : (p + s,) array
            Linear, then shape values.

        Returns
        -------
        (n, J) array
            N·m.
        """
        # Right for a sensor that adds to the torque. One with a gain or a memory overrides this.
        return torque - self.torque(motion, values) if self.torque_reading is not None else torque

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion as it is without this effect in the sensor or transmission.

        Parameters
        ----------
        motion : Motion
            Measured motion.
        shape : (s,) array
            Shape values in this run, in the order of ``self.shape``.
        """
        return motion
