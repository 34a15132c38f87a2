"""The equations of a model, written out: what the C and the MATLAB file hold.

The terms stand in the four groups of ``pipelines.dynamics``: on links and inertial, on links, on
drives and inertial, on drives. Drives feel the torque that is passed on to the links as their
``load``.
"""

from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from pipelines.contracts import Joint
from pipelines.effects import Effect, Parameter, Side
from pipelines.effects.kernel import Instant
from pipelines.export.exported import Exported, column_of, shift_of
from pipelines.export.format import Degree, Holding, exact, left_out
from pipelines.export.formula import (
    Branch,
    Elements,
    Formula,
    NotWritable,
    arrays_in,
    constant,
    constants_in,
    written,
)
from pipelines.export.language import identifier, unique
from pipelines.model import Term

TEMPERATURE = "at.temperature"
"""What no written file is given."""

GROUPS = ("link_inertia", "link_torque", "drive_inertia", "drive_torque")
"""Functions of a written file, in the order in which they are called."""

GEOMETRY = ("thigh_length", "gravity")
"""What kernels receive as ``geometry``."""

RESERVED = (
    *GROUPS,
    *GEOMETRY,
    "sign",
    "at",
    "tau",
    "rate",
    "geometry",
    "at_rest",
    "inertial",
    "velocity_torque",
    "instant",
    "instant_of",
    "sensor_shift",
    "link_shift",
    "memory_rate",
    "torque_reading",
)
"""Names that a written file has for itself."""


@dataclass(frozen=True)
class Constant:
    """A number of the file, with its name."""

    name: str
    value: float
    unit: str
    meaning: str


@dataclass(frozen=True)
class Equation:
    """What a term adds to the torques, or the rate of its memory, or what a sensor makes of the
    torques."""

    label: str
    says: str
    outcome: list | Branch
    first: int = 0
    """Of the elements that it is about, the first one's place."""


@dataclass(frozen=True)
class Equations:
    """A whole model, written out."""

    joints: tuple[Joint, ...]
    constants: tuple[Constant, ...]
    groups: dict[str, list[Equation]]
    rates: list[Equation]
    readings: list[Equation]
    memories: int
    memory_of: tuple[str, ...]
    sensor_shift: tuple[float, ...]
    """By how much encoders are off the motors' angles, rad."""
    link_shift: tuple[float, ...]
    """By how much the motors' angles are off those that gravity and springs know, rad."""

    @property
    def used(self) -> list[Constant]:
        """The constants that stand in an equation; some have only decided which one is written."""
        written_out = [
            e.outcome for e in (*chain(*self.groups.values()), *self.rates, *self.readings)
        ]
        known = set(constants_in(written_out))
        return [c for c in self.constants if c.name in known]


def holding(term: Term) -> Holding:
    """Return what becomes of a term where equations are written out."""
    effect = term.effect
    if effect.spring is not None:
        return left_out("it needs a second coordinate at the joint, which is rigid here")
    if effect.reading_states:
        return left_out("it needs the torques of the past")
    if effect.reading is not None:
        is_shift = shift_of(term) is not None
        return (
            exact("a constant between angles")
            if is_shift
            else left_out("its reading is more than a shift")
        )
    try:
        for kernel in (effect.reaction, effect.derivative, effect.torque_reading):
            if kernel is not None and TEMPERATURE in arrays_in(
                _outcome(term, kernel, list(term.values), "at.q", 0)
            ):
                return left_out("it needs the motor's temperature")
    except NotWritable as error:
        return left_out(str(error))
    if effect.torque_reading is not None:
        return exact("torque_reading")
    return exact(
        "inverse dynamics, its memory an argument" if effect.states else "inverse dynamics"
    )


def equations(exported: Exported) -> Equations:
    """Write a model out."""
    held = [term for term in exported.terms if holding(term).degree is not Degree.NOT]
    named = [(term, parameter) for term in held for parameter in term.effect.fitted]
    names = unique((_constant_name(term.effect, parameter) for term, parameter in named), RESERVED)
    constants = [
        Constant(name, float(value), parameter.unit, f"{term.effect.label}: {parameter.meaning}")
        for name, (term, parameter), value in zip(
            names, named, np.concatenate([term.values for term in held]), strict=True
        )
    ]
    shape = zip(
        GEOMETRY,
        exported.geometry.array(),
        ("m", "m/s²"),
        ("first to second joint axis", "acceleration of gravity"),
        strict=True,
    )
    fixed = [Constant(name, float(value), unit, meaning) for name, value, unit, meaning in shape]
    model = Equations(
        exported.joints,
        (*fixed, *constants),
        {group: [] for group in GROUPS},
        [],
        [],
        0,
        (),
        (),
        (),
    )
    memory_of: list[str] = []
    at = 0
    for term in held:
        count = len(term.effect.fitted)
        values = [constant(c.name, c.value) for c in constants[at : at + count]]
        at += count
        _write(model, term, values, len(memory_of))
        memory_of += [term.effect.label] * term.effect.states
    sensor = exported.shift(Side.SENSOR)
    return replace(
        model,
        memories=len(memory_of),
        memory_of=tuple(memory_of),
        sensor_shift=tuple(sensor.tolist()),
        link_shift=tuple((exported.shift() - sensor).tolist()),
    )


def _constant_name(effect: Effect, parameter: Parameter) -> str:
    return identifier(
        "_".join(part for part in (effect.joint, effect.name, parameter.name) if part)
    )


def _write(model: Equations, term: Term, values: list[Formula], first: int) -> None:
    effect = term.effect
    on_drive = effect.side is Side.DRIVE

    def equation(kernel: Any, first_memory: int = 0) -> Equation:
        outcome = _outcome(term, kernel, values, "at.motor" if on_drive else "at.q", first)
        return Equation(effect.label, effect.equation, outcome, first_memory)

    if effect.reaction is not None:
        model.groups[GROUPS[2 * on_drive + (not effect.inertial)]].append(equation(effect.reaction))
    if effect.derivative is not None:
        model.rates.append(equation(effect.derivative, first))
    if effect.torque_reading is not None:
        model.readings.append(equation(effect.torque_reading))


def _outcome(term: Term, kernel: Any, values: list, angle: str, first: int) -> list | Branch:
    """Return a kernel's equation; ``first`` is the place of the term's memory among all."""
    geometry = [Formula("constant", (name,)) for name in GEOMETRY]
    joints, joint = len(term.effect.on.joints), column_of(term)
    memory = [Formula("element", ("at.memory", first + i)) for i in range(term.effect.states)]
    whole = (
        Elements(name, joints)
        for name in (angle, "at.dq", "at.ddq", "at.direction", "at.load", TEMPERATURE)
    )
    at: Any = Instant._make([Formula("constant", ("at.t",)), *whole])

    def arguments() -> tuple[tuple, list]:
        if kernel is term.effect.torque_reading:
            torque: list = list(Elements("tau", joints))
            return (at.t, torque, values, joint, [], list(Elements(TEMPERATURE, joints))), torque
        out = [0.0] * (joints if kernel is term.effect.reaction else term.effect.states)
        return (at, memory, values, geometry, joint, out), out

    return written(kernel, arguments)
