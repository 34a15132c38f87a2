"""The compiled form of an effect's equation: one scalar kernel each.

A kernel is written once and has two users: ``columns`` evaluates it along a measured motion, and
the forward dynamics evaluates it at every integration step. All kernels of a kind share one
signature, so that the dynamics can hold a tuple of them without compilation for each model.
"""

import warnings
from functools import cache
from typing import Any

import numpy as np
from numba import njit, types
from numba.core import cgutils
from numba.core.errors import NumbaExperimentalFeatureWarning
from numba.core.types import float64, int64, void
from numba.extending import intrinsic

from pipelines.mechanics.instant import INSTANT, REACTION, Instant, compiler_of, vector
from pipelines.mechanics.instant import reaction as reaction

# Kernels as arguments are numba's "first-class functions", which it calls experimental; the
# alternative, code generated for each model, costs seconds of compilation whenever a model changes.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)


@cache
def address(kernel) -> int:
    """Return the address of a kernel's machine code."""
    # Passing the kernels themselves to compiled code costs 60 µs each, at every call.
    (compiled,) = kernel.overloads.values()
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


def _kernel_at(signature):
    kind = types.FunctionType(signature)

    @intrinsic
    def kernel_at(typing_context, where):
        """Return the kernel at an address, for compiled code to call."""

        def lower(context, builder, signature, arguments):
            function = cgutils.create_struct_proxy(kind)(context, builder)
            # Compiled code calls a first-class function by this address.
            function.jit_addr = builder.inttoptr(
                arguments[0], context.get_value_type(types.voidptr)
            )
            return function._getvalue()

        return kind(where), lower

    return kernel_at


def _kind(signature):
    """Return the decorator of kernels of a signature, and the intrinsic that finds them."""
    return compiler_of(signature), _kernel_at(signature)


reaction_at = _kernel_at(REACTION)

derivative, derivative_at = _kind(void(INSTANT, vector, vector, vector, int64, vector))
"""derivative(at, state, values, geometry, joint, out): write the memory's rate to ``out``.

It may depend on the shape values, but not on the linear ones, or torque would not be linear in
them.
"""

spring, spring_at = _kind(float64(float64, float64, vector))
"""spring(twist, twist_rate, values): torque that a transmission passes from motor to link, N·m."""

reading, reading_at = _kind(void(vector, vector, int64))
"""reading(angle, values, joint): turn true angles into those that the encoders report, in place."""

TORQUE_READING = void(float64, vector, vector, int64, vector, vector)
"""torque_reading(t, torque, values, joint, state, temperature): apply a sensor in place.

It turns delivered torques into those that the sensors report. It is called once per sample, in
order. ``state`` is the sensor's memory, zero before the first sample; ``temperature`` is that of
the motors in °C, NaN where it was not measured.
"""

torque_reading_at = _kernel_at(TORQUE_READING)


def torque_reading(function):
    """Compile a torque sensor's reading; the argument temperature is optional."""
    if function.__code__.co_argcount == len(TORQUE_READING.args) - 1:
        return staticmethod(njit(TORQUE_READING)(_at_any_temperature(njit(function))))
    return compiler_of(TORQUE_READING)(function)


def _at_any_temperature(kernel):
    def torque_reading(t, torque, values, joint, state, temperature):
        kernel(t, torque, values, joint, state)

    return torque_reading


_table = float64[:, ::1]
_columns = float64[:, :, ::1]
_MOTION = (vector, *(_table,) * 5, vector)  # time, q, dq, ddq, load, temperature, geometry
# Signatures are spelt out so that one compilation serves every effect: the kernel's address is an
# argument.
_strided = types.Array(float64, 3, "A")


ALLOCATING_NOTHING: dict[str, Any] = {"cache": True, "_nrt": False}
"""Compiler options of functions whose arrays are all arguments. Without numba's reference counting
(``_nrt``) they take less than half of the time."""


@njit(inline="always")
def _unit_columns(kernel, at, state, values, geometry, joint, torque, out):
    """Write the torque per unit of each of the first p values into ``out`` (J, p)."""
    for i in range(out.shape[1]):
        values[i] = 1.0
        torque[:] = 0.0
        kernel(at, state, values, geometry, joint, torque)
        values[i] = 0.0
        for j in range(out.shape[0]):
            out[j, i] = torque[j]


@njit(void(int64, vector, int64, *_MOTION, vector, _columns), **ALLOCATING_NOTHING)
def columns_along(
    where, values, joint, time, q, dq, ddq, load, temperature, geometry, scratch, out
):
    """Evaluate the reaction kernel at an address along a motion.

    The kernel has no memory.

    Parameters
    ----------
    where : int
        Address of the kernel.
    values : (p,) array
        The shape, and zeros for the rest.
    joint : int
        Column of the joint; -1 for the whole machine.
    time : (n,) array
        s.
    q, dq, ddq : (n, J) array
        rad, rad/s and rad/s².
    load : (n, J) array
        Transmitted torque, N·m.
    temperature : (n, J) array
        °C.
    geometry : (2,) array
        Length, m, and gravity, m/s².
    scratch : (2 J,) array
        Overwritten.
    out : (n, J, p) array
        Written: N·m per unit.
    """
    kernel = reaction_at(where)
    joints = q.shape[1]
    direction, torque = scratch[:joints], scratch[joints:]
    for k in range(q.shape[0]):
        for j in range(joints):
            # Wrong only where a joint sticks, and there fits leave the samples out.
            direction[j] = np.sign(dq[k, j])
        at = Instant(time[k], q[k], dq[k], ddq[k], direction, load[k], temperature[k])
        _unit_columns(kernel, at, scratch[:0], values, geometry, joint, torque, out[k])


@njit(inline="always")
def _between(time, q, dq, ddq, load, k, share, at):
    """Write the motion between sample ``k`` and the next into ``at`` (5, J); return its time."""
    for j in range(q.shape[1]):
        at[0, j] = q[k, j] + share * (q[k + 1, j] - q[k, j])
        at[1, j] = dq[k, j] + share * (dq[k + 1, j] - dq[k, j])
        at[2, j] = ddq[k, j] + share * (ddq[k + 1, j] - ddq[k, j])
        at[3, j] = np.sign(at[1, j])
        at[4, j] = load[k, j] + share * (load[k + 1, j] - load[k, j])
    return time[k] + share * (time[k + 1] - time[k])


@njit(inline="always")
def _advance(rate, at, ahead, h, state, middle, slope, values, geometry, joint):
    """Advance a memory by the midpoint rule from ``at``; ``ahead`` is half a step later."""
    rate(at, state, values, geometry, joint, slope)
    for m in range(state.shape[0]):
        middle[m] = state[m] + 0.5 * h * slope[m]
    rate(ahead, middle, values, geometry, joint, slope)
    for m in range(state.shape[0]):
        state[m] += h * slope[m]


@njit(void(int64, int64, vector, int64, *_MOTION, _table, _table, _columns), **ALLOCATING_NOTHING)
def columns_along_with_memory(
    where,
    where_rate,
    values,
    joint,
    time,
    q,
    dq,
    ddq,
    load,
    temperature,
    geometry,
    scratch,
    memory,
    out,
):
    """Evaluate the reaction kernel at an address along one unbroken stretch.

    The memory settles at the first sample. Between samples, the motion is linear in time.

    Parameters
    ----------
    where, where_rate : int
        Addresses of the kernel and of the rate of its memory.
    values : (p,) array
        The shape, and zeros for the rest.
    joint : int
        Column of the joint; -1 for the whole machine.
    time : (n,) array
        s.
    q, dq, ddq : (n, J) array
        rad, rad/s and rad/s².
    load : (n, J) array
        Transmitted torque, N·m.
    temperature : (n, J) array
        °C.
    geometry : (2,) array
        Length, m, and gravity, m/s².
    scratch : (11, J) array
        Overwritten.
    memory : (3, states) array
        Overwritten; its first row must be zeros.
    out : (n, J, p) array
        Written: N·m per unit.
    """
    # Steps per sample along a measured motion: a presliding state changes within a few
    # milliseconds.
    memory_substeps = 8
    # Time for which a motion is assumed to have run at its first velocity before it begins. A
    # memory that began at zero would be wrong until the first reversal.
    settling_s = 2.0
    kernel, rate = reaction_at(where), derivative_at(where_rate)
    state, middle, slope = memory[0], memory[1], memory[2]
    now, later = scratch[:5], scratch[5:10]
    if q.shape[0] > 1:
        h = (time[1] - time[0]) / memory_substeps
        t = _between(time, q, dq, ddq, load, 0, 0.0, now)
        at = Instant(t, now[0], now[1], now[2], now[3], now[4], temperature[0])
        for _ in range(int(settling_s / h)):
            _advance(rate, at, at, h, state, middle, slope, values, geometry, joint)
    for k in range(q.shape[0]):
        for j in range(q.shape[1]):
            now[3, j] = np.sign(dq[k, j])
        at = Instant(time[k], q[k], dq[k], ddq[k], now[3], load[k], temperature[k])
        _unit_columns(kernel, at, state, values, geometry, joint, scratch[10], out[k])
        if k + 1 == q.shape[0]:
            break
        h = (time[k + 1] - time[k]) / memory_substeps
        for i in range(memory_substeps):
            t = _between(time, q, dq, ddq, load, k, i / memory_substeps, now)
            at = Instant(t, now[0], now[1], now[2], now[3], now[4], temperature[k])
            t = _between(time, q, dq, ddq, load, k, (i + 0.5) / memory_substeps, later)
            ahead = Instant(t, later[0], later[1], later[2], later[3], later[4], temperature[k])
            _advance(rate, at, ahead, h, state, middle, slope, values, geometry, joint)


@njit(
    void(int64, vector, int64, vector, _table, _strided, vector, _table, _strided),
    **ALLOCATING_NOTHING,
)
def read_along(where, values, joint, time, temperature, torque, at_once, state, out):
    """Apply a sensor, the kernel at an address, to p torques of one unbroken stretch.

    Parameters
    ----------
    where : int
        Address of the kernel.
    values : array
        Values of the effect.
    joint : int
        Column of the joint.
    time : (n,) array
        s.
    temperature : (n, J) array
        °C.
    torque : (n, J, p) array
        True torques, N·m.
    at_once : (J,) array
        Overwritten.
    state : (p, m) array
        The sensor's memory for each torque, zero before the first sample.
    out : (n, J, p) array
        Written: readings, N·m.
    """
    kernel = torque_reading_at(where)
    # All torques of a sample are next to each other in memory.
    for k in range(torque.shape[0]):
        for i in range(torque.shape[2]):
            for j in range(at_once.shape[0]):
                at_once[j] = torque[k, j, i]
            kernel(time[k], at_once, values, joint, state[i], temperature[k])
            for j in range(at_once.shape[0]):
                out[k, j, i] = at_once[j]


@njit(inline="always")
def _twist_at_rest(kernel, values, torque, stiffness):
    """Return the twist at which spring and load balance."""
    # Largest twist, rad, with which a swinging load begins at rest.
    widest_twist = 1.0
    low, high = -widest_twist, widest_twist
    # Bisection, because a spring with play has no slope within it. 40 halvings reach 1e-11 rad.
    for _ in range(40):
        middle = 0.5 * (low + high)
        if kernel(middle, 0.0, values) + stiffness * middle < torque:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit(void(int64, vector, float64, float64, float64, *(vector,) * 4, vector), **ALLOCATING_NOTHING)
def swing_along(where, values, ratio, least, h, torque, inertia, damping, stiffness, out):
    """Integrate a load that swings on a spring along one unbroken stretch, from rest.

    inertia twist'' + damping twist' + stiffness twist + spring(twist, twist') = torque. All but the
    spring are given by sample, and are linear between samples. The midpoint rule, linearised at
    each step's start, neither damps nor excites, and is stable however stiff the spring.

    Parameters
    ----------
    where : int
        Address of the spring's kernel.
    values : (k,) array
        Parameters of the spring.
    ratio : float
        Damping ratio in addition to the spring's own.
    least : float
        Least inertia of a load, kg·m²; a fit may make that of a light link negative.
    h : float
        Sample interval, s.
    torque, inertia, damping, stiffness : (n,) array
        Of the load; N·m, kg·m², N·m·s/rad, N·m/rad.
    out : (n,) array
        Twist, rad.
    """
    # Steps per sample of a load on its spring. The rule is stable at any stiffness, and accurate up
    # to some 30 Hz.
    swing_substeps = 4
    # Limit of a twist, rad, that no real transmission reaches. A load of negative mass or gravity,
    # which a fit may try, would diverge from its spring within a second; here it stops.
    torn = np.pi
    # Step of a spring's difference quotients, rad and rad/s.
    nudge = 1e-7
    kernel = spring_at(where)
    twist, rate = _twist_at_rest(kernel, values, torque[0], stiffness[0]), 0.0
    out[0] = twist
    s = h / swing_substeps
    for n in range(1, torque.shape[0]):
        for i in range(swing_substeps):
            share = (i + 0.5) / swing_substeps
            load = torque[n - 1] + share * (torque[n] - torque[n - 1])
            mass = max(least, inertia[n - 1] + share * (inertia[n] - inertia[n - 1]))
            drag = damping[n - 1] + share * (damping[n] - damping[n - 1])
            slope = stiffness[n - 1] + share * (stiffness[n] - stiffness[n - 1])
            # The spring's tangent at the step's start.
            passed = kernel(twist, rate, values)
            per_twist = (kernel(twist + nudge, rate, values) - passed) / nudge
            per_rate = (kernel(twist, rate + nudge, values) - passed) / nudge
            drag += 2.0 * ratio * np.sqrt(max(0.0, per_twist) * mass)
            # Midpoint rule: twist and rate are taken half a step ahead, where change is unknown.
            # Solved for the change of the rate.
            push = (
                load - drag * rate - slope * twist - passed - 0.5 * s * (slope + per_twist) * rate
            )
            change = (
                s * push / (mass + 0.5 * s * (drag + per_rate) + 0.25 * s * s * (slope + per_twist))
            )
            twist += s * (rate + 0.5 * change)
            rate += change
            if not abs(twist) < torn:
                twist, rate = torn if twist > 0.0 else -torn, 0.0
        out[n] = twist
