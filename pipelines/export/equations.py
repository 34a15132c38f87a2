"""The equations of a model, for the C and the MATLAB file.

The terms form the four groups of ``pipelines.dynamics``: on links and inertial, on links, on drives
and inertial, on drives. The torque of the links is the ``load`` of the drives.
"""

from dataclasses import dataclass, field
from itertools import chain
from typing import Any

from pipelines.contracts import Joint
from pipelines.effects import Side
from pipelines.effects.kernel import Instant
from pipelines.export.exported import ExportedModel, column_of, shift_of
from pipelines.export.format import Degree, Holding, exact, left_out
from pipelines.export.formula import (
    Branch,
    Elements,
    Formula,
    NotWritable,
    constant,
    names_in,
    outcome_of,
)
from pipelines.export.language import identifier, unique
from pipelines.model import Term

GROUPS = ("link_inertia", "link_torque", "drive_inertia", "drive_torque")
"""Functions of an exported file, in the order of their calls."""


@dataclass(frozen=True)
class Constant:
    """A number of the file, with its name."""

    name: str
    value: float
    unit: str
    meaning: str


@dataclass(frozen=True)
class Equation:
    """The torque of a term, the rate of its memory, or a sensor's reading of the torques."""

    label: str
    text: str
    outcome: list | Branch
    first: int = 0
    """Index of its first element."""


@dataclass(frozen=True)
class Equations:
    """The equations of a whole model."""

    joints: tuple[Joint, ...]
    constants: list[Constant]
    sensor_shift: tuple[float, ...]
    """Encoders' angles less the motors', rad."""
    link_shift: tuple[float, ...]
    """Motors' angles less the links', on which gravity and springs depend, rad."""
    groups: dict[str, list[Equation]] = field(default_factory=lambda: {name: [] for name in GROUPS})
    rates: list[Equation] = field(default_factory=list)
    readings: list[Equation] = field(default_factory=list)
    memory_of: list[str] = field(default_factory=list)
    """Label of the effect of each memory."""

    @property
    def memories(self) -> int:
        """Number of memories."""
        return len(self.memory_of)

    @property
    def used(self) -> list[Constant]:
        """The constants in the equations; others only selected a branch."""
        every = (*chain(*self.groups.values()), *self.rates, *self.readings)
        names = set(names_in([equation.outcome for equation in every], "constant"))
        return [c for c in self.constants if c.name in names]


def holding(term: Term) -> Holding:
    """Return how a file of equations holds a term."""
    effect = term.effect
    if effect.spring is not None:
        return left_out("it needs a second coordinate at the joint, which is rigid here")
    if effect.reading_states:
        return left_out("it needs the torques of the past")
    if effect.reading is not None:
        if shift_of(term) is None:
            return left_out("its reading is more than a shift")
        return exact("a constant between angles")
    kernels = (effect.reaction, effect.derivative, effect.torque_reading)
    try:
        present = [kernel for kernel in kernels if kernel is not None]
        # With the values as numbers, so that a condition on them alone is decided as in the file.
        outcomes = [_outcome(term, kernel, list(term.values), "at.q", 0) for kernel in present]
    except NotWritable as error:
        return left_out(str(error))
    # The caller of an exported file has no measurement of it.
    if "at.temperature" in names_in(outcomes, "element"):
        return left_out("it needs the motor's temperature")
    if effect.torque_reading is not None:
        return exact("torque_reading")
    return exact(
        "inverse dynamics, its memory an argument" if effect.states else "inverse dynamics"
    )


def equations(exported: ExportedModel) -> Equations:
    """Return the equations of a model.

    Parameters
    ----------
    exported : ExportedModel
        Terms that no equation holds are left out.

    Returns
    -------
    Equations
        Constants in SI units; shifts of J angles, rad.
    """
    terms = [term for term in exported.terms if holding(term).degree is not Degree.NOT]
    named = ((term.effect, parameter) for term in terms for parameter in term.effect.fitted)
    full = (filter(None, (effect.joint, effect.name, p.name)) for effect, p in named)
    own_names = """
        sign at tau rate geometry thigh_length gravity at_rest inertial velocity_torque instant
        instant_of sensor_shift link_shift memory_rate torque_reading
    """
    # Two effects can have parameters of one name at a joint; the file's own names are taken, too.
    taken = (*GROUPS, *own_names.split())
    names = iter(unique((identifier("_".join(parts)) for parts in full), taken))
    length, gravity = exported.geometry.array().tolist()
    # An encoder's error is in the angles of motor and link alike, a tilt only in the link's.
    sensor = exported.shift(Side.SENSOR)
    model = Equations(
        exported.joints,
        [
            Constant("thigh_length", length, "m", "first to second joint axis"),
            Constant("gravity", gravity, "m/s²", "acceleration of gravity"),
        ],
        sensor_shift=tuple(sensor.tolist()),
        link_shift=tuple((exported.shift() - sensor).tolist()),
    )
    for term in terms:
        label = term.effect.label
        own = [
            Constant(next(names), float(value), p.unit, f"{label}: {p.meaning}")
            for p, value in zip(term.effect.fitted, term.values, strict=True)
        ]
        model.constants.extend(own)
        values = [constant(c.name, c.value) for c in own]
        _add_equations(model, term, values, model.memories)
        model.memory_of.extend([label] * term.effect.states)
    return model


def _add_equations(model: Equations, term: Term, values: list[Formula], first: int) -> None:
    effect = term.effect
    on_drive = effect.side is Side.DRIVE

    def equation(kernel: Any, first_memory: int = 0) -> Equation:
        outcome = _outcome(term, kernel, values, "at.motor" if on_drive else "at.q", first)
        return Equation(effect.label, effect.equation, outcome, first_memory)

    if effect.reaction is not None:
        # Links come before drives, and inertia before the rest: the load of the drives must be
        # known.
        model.groups[GROUPS[2 * on_drive + (not effect.inertial)]].append(equation(effect.reaction))
    if effect.derivative is not None:
        model.rates.append(equation(effect.derivative, first))
    if effect.torque_reading is not None:
        model.readings.append(equation(effect.torque_reading))


def _outcome(term: Term, kernel: Any, values: list, angle: str, first: int) -> list | Branch:
    """Return a kernel's outcome; ``first`` is the index of the term's memory."""
    geometry = [Formula("constant", (name,)) for name in ("thigh_length", "gravity")]
    joints, joint = len(term.effect.on.joints), column_of(term)
    memory = [Formula("element", ("at.memory", first + i)) for i in range(term.effect.states)]
    whole = (
        Elements(name, joints)
        for name in (angle, "at.dq", "at.ddq", "at.direction", "at.load", "at.temperature")
    )
    at: Any = Instant._make([Formula("constant", ("at.t",)), *whole])

    def arguments() -> tuple[tuple, list]:
        # A reading starts from the drives' torques and changes some; other kernels write to zeros.
        if kernel is term.effect.torque_reading:
            torque: list = list(Elements("tau", joints))
            return (
                at.t,
                torque,
                values,
                joint,
                [],
                list(Elements("at.temperature", joints)),
            ), torque
        out = [0.0] * (joints if kernel is term.effect.reaction else term.effect.states)
        return (at, memory, values, geometry, joint, out), out

    return outcome_of(kernel, arguments)
