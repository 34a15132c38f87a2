"""Forward dynamics of any model: accelerations from drive torque, and one time step.

A joint has two coordinates, the motor's and the link's, which coincide if it is rigid. Motors carry
the drive's effects and the encoder; links carry everything else. With T the transmitted torque::

    M(q) ddq + rest(q, dq) = T          links (structure, human)
    J dd_theta + drive(theta, d_theta) + T = drive torque     motors; T from the spring

and a rigid joint is the sum of its two rows. If a limb moves in a compliant cuff, the cuff is the
spring, the limb the link, and the whole machine the motors, whose J is then the machine's mass
matrix.

Dry friction is a set-valued function of speed. The step finds the ``direction`` in [-1, 1] of each
joint that is consistent with the speed at the step's end (projected Gauss-Seidel on the
complementarity problem; Stewart and Trinkle, 1996), so that joints stick without chatter.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof
from numba.core.types import float64, void
from numpy.typing import NDArray

from pipelines.dynamics.assembly import ASSEMBLY, Assembly
from pipelines.dynamics.compiled_once import compiled_once
from pipelines.effects.kernel import (
    ALLOCATING_NOTHING,
    Instant,
    derivative_at,
    reaction_at,
    spring_at,
)
from pipelines.mechanics.instant import vector

INNER: dict[str, Any] = {
    **ALLOCATING_NOTHING,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
"""Compiler options of functions that Python never calls; their wrappers would take long to
compile."""

Q, DQ, THETA, DTHETA = range(4)
"""Rows of a state (4, J): link angle and speed, motor angle and speed."""


def resting_state(q: NDArray) -> NDArray:
    """Return the state of a machine at rest with relaxed springs.

    Parameters
    ----------
    q : (J,) array
        Angles, rad.

    Returns
    -------
    (4, J) array
        Rows Q, DQ, THETA, DTHETA: angle (rad) and speed (rad/s) of the links, then of the motors.
    """
    still = np.zeros_like(q, dtype=float)
    return np.array([q, still, q, still], dtype=float)


class Workspace(NamedTuple):
    """Scratch arrays of one simulation, so that its inner loop allocates nothing."""

    zero: np.ndarray
    ddq: np.ndarray
    mass: np.ndarray
    motor_mass: np.ndarray
    rest: np.ndarray
    passed: np.ndarray
    friction: np.ndarray
    push: np.ndarray
    column: np.ndarray
    slope: np.ndarray
    direction: np.ndarray
    link_direction: np.ndarray
    both_masses: np.ndarray
    both: np.ndarray


def workspace(joints: int) -> Workspace:
    """Return the scratch arrays of the equations of motion.

    Parameters
    ----------
    joints : int
        Number of joints, J.

    Returns
    -------
    Workspace
        Vectors (J,), matrices (J, J), and a system of 2 J equations.
    """
    v = np.zeros((10, joints))
    m = np.zeros((2, joints, joints))
    both = np.zeros((2 * joints, 2 * joints))
    return Workspace._make([*v[:2], *m, *v[2:], both, np.zeros(2 * joints)])


states = float64[:, ::1]
WORKSPACE = typeof(workspace(1))


# Inlined, because a call passes the whole assembly, which costs as much as the equations.
@njit(cache=True, inline="always")
def _react(a, first, last, at, memory, out):
    """Add the reactions of terms ``first`` to ``last - 1`` to ``out`` (J,)."""
    for i in range(first, last):
        values = a.values[a.value_at[i] : a.value_at[i + 1]]
        state = memory[a.state_at[i] : a.state_at[i + 1]]
        reaction_at(a.reactions[i])(at, state, values, a.geometry, a.joint[i], out)


@njit(cache=True, inline="always")
def _mass_and_rest(a, w, first, last, t, angle, speed, direction, load, memory, M, rest):
    """Write the inertial terms' mass matrix (J, J), and their torque at zero acceleration (J,).

    The mass matrix is the torque at unit acceleration less that at zero acceleration (Walker and
    Orin, 1982).
    """
    w.ddq[:] = 0.0
    at = Instant(t, angle, speed, w.ddq, direction, load, a.temperature)
    # First without acceleration: one copy of the call compiles faster.
    for k in range(-1, a.joints):
        if k >= 0:
            w.ddq[k] = 1.0
        w.column[:] = 0.0
        _react(a, first, last, at, memory, w.column)
        if k >= 0:
            w.ddq[k] = 0.0
        for row in range(a.joints):
            if k < 0:
                rest[row] = w.column[row]
            else:
                M[row, k] = w.column[row] - rest[row]


@njit(cache=True, inline="always")
def _solve(M, b, scratch, x):
    """Solve M x = b, explicitly for one or two joints; ``scratch`` is for more."""
    if b.shape[0] == 1:
        x[0] = b[0] / M[0, 0]
    elif b.shape[0] == 2:
        determinant = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
        x[0] = (M[1, 1] * b[0] - M[0, 1] * b[1]) / determinant
        x[1] = (M[0, 0] * b[1] - M[1, 0] * b[0]) / determinant
    else:
        for row in range(b.shape[0]):
            x[row] = b[row]
            for column in range(b.shape[0]):
                scratch[row, column] = M[row, column]
        _eliminate(scratch, x)


@njit(cache=True, inline="always")
def _prepare(a, w, t, state, memory, load):
    """Compute everything independent of friction's direction: masses, link and spring torque."""
    links, others, drives, last = a.bounds[0], a.bounds[1], a.bounds[2], a.bounds[3]
    q, dq, theta, dtheta = state[Q], state[DQ], state[THETA], state[DTHETA]
    for j in range(a.joints):
        # Only drives have dry friction that can hold; links need the sign alone.
        w.link_direction[j] = np.sign(dq[j])
    _mass_and_rest(a, w, links, others, t, q, dq, w.link_direction, load, memory, w.mass, w.rest)
    # Terms without inertia need one evaluation, and not one more for each joint.
    if drives > others:
        at = Instant(t, q, dq, w.zero, w.link_direction, load, a.temperature)
        _react(a, others, drives, at, memory, w.rest)
    if last > drives:
        _mass_and_rest(
            a, w, drives, last, t, theta, dtheta, w.zero, load, memory, w.motor_mass, w.push
        )
    for j in range(a.joints):
        term = a.sprung[j]
        if term < 0:
            if not a.cuffed:
                # A rigid joint has one coordinate. A rotor's inertia acts at its own joint, so that
                # only the diagonal counts.
                w.mass[j, j] += w.motor_mass[j, j]
        else:
            values = a.values[a.value_at[term] : a.value_at[term + 1]]
            # Positive while the motor is ahead: the spring then pushes the link forward.
            w.passed[j] = spring_at(a.springs[term])(theta[j] - q[j], dtheta[j] - dq[j], values)


@njit(**INNER)
def _accelerate_both(a, w, state, drive, rates):
    """Write d(state)/dt of machine and limb, whose masses are coupled across rigid joints.

    The unknowns are the accelerations of the links, then of the motors; those of a rigid joint are
    equal.
    """
    joints = a.joints
    w.both_masses[:] = 0.0
    for j in range(joints):
        motor = joints + j
        # At a rigid joint the torques of motor and link are one equation, in the link's row.
        row = j if a.sprung[j] < 0 else motor
        for k in range(joints):
            w.both_masses[j, k] = w.mass[j, k]
            w.both_masses[row, joints + k] = w.motor_mass[j, k]
        if a.sprung[j] < 0:
            w.both[j] = drive[j] - w.friction[j] - w.rest[j]
            # The motor's row states that both accelerations are equal.
            w.both_masses[motor, motor], w.both_masses[motor, j], w.both[motor] = 1.0, -1.0, 0.0
        else:
            w.both[j] = w.passed[j] - w.rest[j]
            w.both_masses[motor, motor] += a.motor_inertia[j]
            w.both[motor] = drive[j] - w.friction[j] - w.passed[j]
    _eliminate(w.both_masses, w.both)
    for j in range(joints):
        rates[Q, j], rates[DQ, j] = state[DQ, j], w.both[j]
        rates[THETA, j], rates[DTHETA, j] = state[DTHETA, j], w.both[joints + j]


@njit(**INNER)
def _eliminate(A, b):
    """Solve A x = b in place by Gaussian elimination with partial pivoting; ``b`` (n,) becomes x.

    Only the first n rows and columns of a larger ``A`` are used.
    """
    n = b.shape[0]
    for i in range(n):
        # Rows of equal accelerations make the matrix unsymmetric, so that pivots have to be chosen.
        pivot = i
        for row in range(i + 1, n):
            if abs(A[row, i]) > abs(A[pivot, i]):
                pivot = row
        for column in range(n):
            A[i, column], A[pivot, column] = A[pivot, column], A[i, column]
        b[i], b[pivot] = b[pivot], b[i]
        for row in range(i + 1, n):
            factor = A[row, i] / A[i, i]
            for column in range(i, n):
                A[row, column] -= factor * A[i, column]
            b[row] -= factor * b[i]
    for i in range(n - 1, -1, -1):
        for column in range(i + 1, n):
            b[i] -= A[i, column] * b[column]
        b[i] /= A[i, i]


@njit(cache=True, inline="always")
def _finish(a, w, t, state, memory, direction, load, drive, rates):
    """Write d(state)/dt for a direction of dry friction, after ``_prepare``."""
    # Drive terms at zero acceleration, because their inertia is in the mass matrix.
    w.friction[:] = 0.0
    at = Instant(t, state[THETA], state[DTHETA], w.zero, direction, load, a.temperature)
    _react(a, a.bounds[2], a.bounds[4], at, memory, w.friction)
    if a.cuffed:
        _accelerate_both(a, w, state, drive, rates)
        return
    for j in range(a.joints):
        if a.sprung[j] < 0:
            w.push[j] = drive[j] - w.friction[j] - w.rest[j]
        else:
            w.push[j] = w.passed[j] - w.rest[j]
            inertia = a.motor_inertia[j] + w.motor_mass[j, j]
            rates[DTHETA, j] = (drive[j] - w.friction[j] - w.passed[j]) / inertia
    _solve(w.mass, w.push, w.both_masses, rates[DQ])
    for j in range(a.joints):
        rates[Q, j] = state[DQ, j]
        rates[THETA, j] = state[DTHETA, j]
        if a.sprung[j] < 0:
            rates[DTHETA, j] = rates[DQ, j]


RATES = void(ASSEMBLY, WORKSPACE, float64, states, vector, vector, vector, vector, states)


@compiled_once(RATES)
def accelerations(a, w, t, state, memory, direction, load, drive, rates):
    """Write d(state)/dt into ``rates`` (4, J).

    Parameters
    ----------
    a : Assembly
        Model.
    w : Workspace
        Scratch.
    t : float
        Time, s.
    state : (4, J) array
        Rows Q, DQ, THETA, DTHETA.
    memory : (m,) array
        Memories of all effects.
    direction : (J,) array
        Sign of each motor's speed, or the value in [-1, 1] that holds it.
    load : (J,) array
        Torque transmitted to the links in the last step, N·m.
    drive : (J,) array
        Drive torque, N·m.
    """
    _prepare(a, w, t, state, memory, load)
    _finish(a, w, t, state, memory, direction, load, drive, rates)


@compiled_once(void(ASSEMBLY, WORKSPACE, float64, states, vector, vector, vector, vector))
def memory_rates(a, w, t, state, memory, direction, load, rates):
    """Write the rates of all memories.

    Parameters
    ----------
    a : Assembly
        Effects of J joints with m memories.
    w : Workspace
        Scratch arrays.
    t : float
        Time, s.
    state : (4, J) array
        Angles and speeds.
    memory : (m,) array
        Memories.
    direction : (J,) array
        Sign of each motor's speed, or the value that stops it.
    load : (J,) array
        Transmitted torque, N·m.
    rates : (m,) array
        Written: d(memory)/dt.
    """
    if rates.shape[0] > 0:
        motor = Instant(t, state[THETA], state[DTHETA], w.zero, direction, load, a.temperature)
        link = Instant(t, state[Q], state[DQ], w.zero, direction, load, a.temperature)
        for i in range(a.bounds[4]):
            first, last = a.state_at[i], a.state_at[i + 1]
            if last > first:
                values = a.values[a.value_at[i] : a.value_at[i + 1]]
                at = motor if i >= a.bounds[2] else link
                derivative_at(a.derivatives[i])(
                    at, memory[first:last], values, a.geometry, a.joint[i], rates[first:last]
                )


@compiled_once(RATES)
def _rates_under(a, w, t, state, memory, direction, load, drive, rates):
    """Compute ``_finish`` without inlining, for rare cases."""
    _finish(a, w, t, state, memory, direction, load, drive, rates)


@njit(**INNER)
def _grip(a, w, t, state, memory, load, drive, rates, j):
    """Return the slope of a motor's acceleration in its direction, rad/s².

    It is negative for dry friction.
    """
    # Dry friction is linear in the direction, so that both ends give the slope.
    now = w.direction[j]
    w.direction[j] = -1.0
    _rates_under(a, w, t, state, memory, w.direction, load, drive, rates)
    backward = rates[DTHETA, j]
    w.direction[j] = 1.0
    _rates_under(a, w, t, state, memory, w.direction, load, drive, rates)
    w.direction[j] = now
    return 0.5 * (rates[DTHETA, j] - backward)


@compiled_once(void(ASSEMBLY, WORKSPACE, float64, float64, states, vector, vector, vector, states))
def find_direction(a, w, t, h, state, memory, load, drive, rates):
    """Write the sign of each motor's speed over the next step.

    If neither sign is consistent with the resulting speed, it is the value that stops the joint.

    Parameters
    ----------
    a : Assembly
        Effects of J joints with m memories.
    w : Workspace
        ``w.direction`` (J,) is written.
    t, h : float
        Time and step, s.
    state : (4, J) array
        Angles and speeds.
    memory : (m,) array
        Memories.
    load, drive : (J,) array
        Transmitted torque and drive torque, N·m.
    rates : (4, J) array
        Written: d(state)/dt with that direction.
    """
    # Each joint's direction changes the others' speeds, so the joints are swept until none changes.
    stiction_sweeps = 20
    stiction_tolerance = 1e-9
    for j in range(a.joints):
        w.direction[j] = np.sign(state[DTHETA, j])
    accelerations(a, w, t, state, memory, w.direction, load, drive, rates)
    # Most steps have no reversal, and need this one evaluation only.
    crossing = False
    for j in range(a.joints):
        crossing |= (state[DTHETA, j] + h * rates[DTHETA, j]) * w.direction[j] <= 0.0
    if not crossing:
        return
    for j in range(a.joints):
        w.slope[j] = _grip(a, w, t, state, memory, load, drive, rates, j)
    for _ in range(stiction_sweeps):
        change = 0.0
        for j in range(a.joints):
            _rates_under(a, w, t, state, memory, w.direction, load, drive, rates)
            ahead = state[DTHETA, j] + h * rates[DTHETA, j]
            before = w.direction[j]
            if w.slope[j] < 0.0:
                # The direction at which this joint would just stop, limited to what friction can
                # hold.
                w.direction[j] = min(1.0, max(-1.0, before - ahead / (h * w.slope[j])))
            else:
                # Without dry friction nothing can hold this joint.
                w.direction[j] = np.sign(ahead)
            change = max(change, abs(w.direction[j] - before))
        if change < stiction_tolerance:
            break
    _rates_under(a, w, t, state, memory, w.direction, load, drive, rates)


class Stages(NamedTuple):
    """Scratch of the Runge-Kutta step: four rates of state and memory, and a stage's values."""

    rates: np.ndarray
    memory_rates: np.ndarray
    state: np.ndarray
    memory: np.ndarray


def stages(joints: int, memories: int) -> Stages:
    """Return the scratch arrays of the Runge-Kutta step.

    Parameters
    ----------
    joints, memories : int
        Numbers of joints, J, and of memories, m.

    Returns
    -------
    Stages
        Rates (4, 4, J) and (4, m), state (4, J) and memory (m,).
    """
    return Stages(
        np.zeros((4, 4, joints)), np.zeros((4, memories)), np.zeros((4, joints)), np.zeros(memories)
    )


STAGES = typeof(stages(1, 1))


@njit(cache=True, inline="always")
def begin_stages(a, w, s, t, state, memory, load):
    """Complete the first stage of a step.

    Parameters
    ----------
    a : Assembly
        Effects of J joints with m memories.
    w : Workspace
        ``w.direction`` must be known.
    s : Stages
        ``s.rates[0]`` must be known; ``s.memory_rates[0]`` is written.
    t : float
        Time, s.
    state : (4, J) array
        Angles and speeds.
    memory : (m,) array
        Memories.
    load : (J,) array
        Written: transmitted torque, N·m.
    """
    memory_rates(a, w, t, state, memory, w.direction, load, s.memory_rates[0])
    load[:] = 0.0
    # What the links need at this acceleration is what the drive trains transmit.
    at = Instant(t, state[Q], state[DQ], s.rates[0, DQ], w.direction, w.zero, a.temperature)
    _react(a, a.bounds[0], a.bounds[2], at, memory, load)


@njit(cache=True, inline="always")
def reach_stage(s, i, reach, state, memory):
    """Write state and memory of a stage.

    Parameters
    ----------
    s : Stages
        ``s.state`` and ``s.memory`` are written.
    i : int
        Number of the stage, 1 to 3.
    reach : float
        Time since the step's beginning, s.
    state : (4, J) array
        At the beginning.
    memory : (m,) array
        At the beginning.
    """
    for row in range(4):
        for j in range(state.shape[1]):
            s.state[row, j] = state[row, j] + reach * s.rates[i - 1, row, j]
    for m in range(memory.shape[0]):
        s.memory[m] = memory[m] + reach * s.memory_rates[i - 1, m]


@njit(cache=True, inline="always")
def weighted(k):
    """Return the four stages' sum with the classical Runge-Kutta weights."""
    return k[0] + 2.0 * k[1] + 2.0 * k[2] + k[3]


@njit(cache=True, inline="always")
def end_stages(s, h, state, memory):
    """Advance state and memory by the weighted mean of the four stages.

    Parameters
    ----------
    s : Stages
        All four stages.
    h : float
        Step, s.
    state : (4, J) array
        Changed in place.
    memory : (m,) array
        Changed in place.
    """
    for row in range(4):
        for j in range(state.shape[1]):
            state[row, j] += h / 6.0 * weighted(s.rates[:, row, j])
    for m in range(memory.shape[0]):
        memory[m] += h / 6.0 * weighted(s.memory_rates[:, m])


@compiled_once(void(ASSEMBLY, WORKSPACE, STAGES, float64, float64, states, vector, vector, vector))
def step(a, w, s, t, h, state, memory, load, drive):
    """Advance state, memory and load by one step.

    Classical Runge-Kutta under constant drive torque; the direction of dry friction is held over
    the step.

    Parameters
    ----------
    a : Assembly
        Effects of J joints with m memories.
    w : Workspace
        Scratch arrays.
    s : Stages
        Scratch arrays.
    t, h : float
        Time and step, s.
    state : (4, J) array
        Angles and speeds; changed in place.
    memory : (m,) array
        Memories; changed in place.
    load : (J,) array
        Transmitted torque, N·m; changed in place.
    drive : (J,) array
        Drive torque, N·m.
    """
    find_direction(a, w, t, h, state, memory, load, drive, s.rates[0])
    begin_stages(a, w, s, t, state, memory, load)
    for i in range(1, 4):
        reach = h if i == 3 else 0.5 * h
        reach_stage(s, i, reach, state, memory)
        accelerations(a, w, t + reach, s.state, s.memory, w.direction, load, drive, s.rates[i])
        memory_rates(a, w, t + reach, s.state, s.memory, w.direction, load, s.memory_rates[i])
    end_stages(s, h, state, memory)


def memory_size(a: Assembly) -> int:
    """Return the number of memories of all effects together."""
    return int(a.state_at[-1])
