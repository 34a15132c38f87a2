"""A model in flat arrays for compiled code: addresses of kernels, values and memory."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numba.core import types
from numba.core.types import boolean, float64, int64
from numpy.typing import NDArray

from pipelines.effects import Effect, Side
from pipelines.effects.baseline import RigidBody
from pipelines.effects.kernel import address, derivative, reaction, reading, spring, torque_reading
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.instant import REFERENCE_C
from pipelines.model import Model, Term


@reaction
def _no_reaction(at, state, values, geometry, joint, out):
    pass


@derivative
def _no_memory(at, state, values, geometry, joint, out):
    pass


@spring
def _no_spring(twist, twist_rate, values):
    return 0.0


@reading
def _no_reading(angle, values, joint):
    pass


@torque_reading
def _no_torque_reading(t, torque, values, joint, state, temperature):
    pass


class Assembly(NamedTuple):
    """The model in the form that the compiled dynamics needs.

    Terms are in the order: on links and inertial, on links, on drives and inertial, on drives;
    ``bounds`` (5,) holds the start of each group and the end of the last. Term i has the addresses
    of its kernels, ``joint[i]`` (-1 for the whole leg), values ``values[value_at[i] : value_at[i +
    1]]`` and a memory ``state_at[i] : state_at[i + 1]``. All fields are arrays, so that one
    compilation serves all models.
    """

    joints: int
    bounds: np.ndarray
    reactions: np.ndarray
    derivatives: np.ndarray
    springs: np.ndarray
    readings: np.ndarray
    torque_readings: np.ndarray
    joint: np.ndarray
    values: np.ndarray
    value_at: np.ndarray
    state_at: np.ndarray
    sensed_at: np.ndarray
    """Like ``state_at``, for the memory of torque sensors."""
    sprung: np.ndarray
    """The term that is each joint's transmission, -1 for a rigid one."""
    motor_inertia: np.ndarray
    cuffed: bool
    """True if the springs are cuffs: links are then those of the limb, and the machine's own bodies
    are on the motors' side."""
    geometry: np.ndarray
    temperature: np.ndarray
    """(J,) °C of the motors; a simulation of a machine that warms sets it before each sample."""


_indices, _reals = int64[::1], float64[::1]
ASSEMBLY = types.NamedTuple(
    [int64, *(_indices,) * 7, _reals, *(_indices,) * 4, _reals, boolean, _reals, _reals], Assembly
)
"""Type of the assembly in compiled code."""


def _addresses(kernels: Sequence, blank) -> NDArray:
    # The decorators return static methods for classes; the blanks here are in none.
    return np.array([address(kernel or blank.__func__) for kernel in kernels], dtype=np.int64)


def assemble(model: Model, geometry: Geometry, joints: Sequence[str] = ("hip", "knee")) -> Assembly:
    """Convert a model for the compiled dynamics.

    Parameters
    ----------
    model : Model
        Terms of one kind of run (``Model.for_run``).
    geometry : Geometry
        Lengths and gravity.
    joints : sequence of str
        Names of the joints.

    Raises
    ------
    InputError
        If a joint has two transmissions, or cuffs and joints are both compliant.
    """
    terms = in_order(model)
    effects = [term.effect for term in terms]
    has_cuffs, groups = cuffed(effects), np.arange(5)
    joint = np.array([joints.index(e.joint) if e.joint else -1 for e in effects], dtype=np.int64)
    sprung = np.full(len(joints), -1, dtype=np.int64)
    inertias = np.zeros(len(joints))
    for i, effect in enumerate(effects):
        if effect.spring is None:
            continue
        if effect.at_cuff != has_cuffs:
            raise InputError(
                f"{effect.label}: a simulation supports compliant cuffs or compliant joints,"
                " not both; remove one of them"
            )
        if sprung[joint[i]] >= 0:
            raise InputError(
                f"{effect.label}: the joint has another transmission already, and can have one;"
                " remove one of them"
            )
        # A motor without inertia could not be integrated in front of its spring.
        sprung[joint[i]], inertias[joint[i]] = i, motor_inertia(effect, model, geometry)
    return Assembly(
        joints=len(joints),
        bounds=np.searchsorted([_group(e, has_cuffs) for e in effects], groups).astype(np.int64),
        reactions=_addresses([e.reaction for e in effects], _no_reaction),
        derivatives=_addresses([e.derivative for e in effects], _no_memory),
        springs=_addresses([e.spring for e in effects], _no_spring),
        readings=_addresses([e.reading for e in effects], _no_reading),
        torque_readings=_addresses([e.torque_reading for e in effects], _no_torque_reading),
        joint=joint,
        values=np.concatenate([term.values for term in terms]).astype(float),
        value_at=_offsets([len(term.values) for term in terms]),
        state_at=_offsets([e.states for e in effects]),
        sensed_at=_offsets([e.reading_states for e in effects]),
        sprung=sprung,
        motor_inertia=inertias,
        cuffed=has_cuffs,
        geometry=geometry.array(),
        temperature=np.full(len(joints), REFERENCE_C),
    )


def motor_inertia(effect: Effect, model: Model, geometry: Geometry) -> float:
    """Return the inertia on the motor's side of a compliant joint, kg·m²; kg at a prismatic joint.

    Raises
    ------
    InputError
        If the joint has play and the machine is no exoskeleton.
    """
    # Share of a joint's inertia that stays with its motor in front of a spring, for machines other
    # than the exoskeleton; as of a leg.
    motor_share = 0.04
    if effect.on.is_exoskeleton:
        return effect.motor_inertia
    if effect.exoskeleton_only:
        raise InputError(
            f"{effect.label}: {effect.title.lower()} can only be simulated for an exoskeleton's"
            " joints; simulate the model without it, as `exoid identify` writes it"
        )
    mechanism = effect.on.mechanism
    X = np.sum([term.values for term in model if isinstance(term.effect, RigidBody)], axis=0)
    j = effect.on.names.index(str(effect.joint))
    return float(
        motor_share * mechanism.mass_matrix(np.zeros(len(mechanism.kinds)), X, geometry)[j, j]
    )


def in_order(model: Model) -> list[Term]:
    """Return a model's terms in the order of an assembly.

    Parameters
    ----------
    model : Model
        Terms in any order.

    Returns
    -------
    list of Term
        Group by group.
    """
    has_cuffs = cuffed([term.effect for term in model])
    return sorted(model, key=lambda term: _group(term.effect, has_cuffs))


def cuffed(effects: Iterable[Effect]) -> bool:
    """Return whether a limb moves in a compliant cuff."""
    return any(effect.at_cuff for effect in effects)


def _group(effect: Effect, has_cuffs: bool) -> int:
    # A compliant cuff is the spring: the whole machine is on its motors' side.
    on_motor = not effect.on_limb if has_cuffs else effect.side is Side.DRIVE
    # Inertial terms first, because only they enter the mass matrices.
    return 2 * on_motor + (not effect.inertial)


def _offsets(lengths: Sequence[int]) -> NDArray:
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
