"""Adaptive tracking with a radial-basis network for each joint.

Source: paper, section 2.2, as corrected in docs/errata.md. With e the error of the angle and r = de
+ Lambda e (the paper's q)::

    torque = W' H(x) + Kv r + gain sgn r,   limited
    dW/dt  = F H(x) r,                      paused while the torque is at its limit
    H_i(x) = exp(-|x - c_i|² / b²),         x = (e, de, qd, dqd, ddqd) of the joint

Leg, memories and weights are integrated together by the classical Runge-Kutta method. The direction
of dry friction is held over a step, as everywhere in the forward dynamics. A step in which a joint
turns, or a torque reaches or leaves its limit, is halved until the switch is located, because its
time limits the accuracy.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof
from numba.core import types
from numba.core.types import boolean, float64
from numpy.typing import NDArray

from pipelines.dynamics.assembly import ASSEMBLY, Assembly
from pipelines.dynamics.compiled_once import compiled_once
from pipelines.dynamics.forward import (
    DTHETA,
    INNER,
    STAGES,
    THETA,
    WORKSPACE,
    Stages,
    Workspace,
    accelerations,
    begin_stages,
    end_stages,
    find_direction,
    memory_rates,
    memory_size,
    reach_stage,
    resting_state,
    stages,
    states,
    weighted,
    workspace,
)
from pipelines.dynamics.pd_loop import read_encoders, whole_counts
from pipelines.effects.kernel import ALLOCATING_NOTHING
from pipelines.mechanics.instant import vector

TURN = 2.0 * np.pi
"""Angle, rad, at which a joint counts as running away."""


class RbfController(NamedTuple):
    """Gains and network, the same for all joints."""

    error_gain: float
    """Lambda, 1/s."""
    feedback_gain: float
    """Kv, N·m·s/rad."""
    adaptation_gain: float
    """F."""
    robust_gain: float
    """Bound on the torque that network and disturbance leave uncompensated, N·m."""
    limit: float
    """N·m."""
    nodes: np.ndarray
    """(m,) positions of the Gaussians' centres on the diagonal of the input space."""
    width: float
    """b of every Gaussian."""


class Encoder(NamedTuple):
    """The controller's reading of a motor's angle, once per step."""

    noise: np.ndarray
    """(n, J) rad, added to each reading; (0, J) for an ideal encoder, which also measures speed."""
    rad_per_count: float
    """Resolution; 0 for an encoder that does not count."""
    speed_share: float
    """Share of a new difference of angles in the low-passed speed at each reading, (0, 1]."""


class _Network(NamedTuple):
    """Rates of the weights at four stages, a stage's weights, and the neurons' activation."""

    rates: np.ndarray
    stage: np.ndarray
    activation: np.ndarray


class _Seen(NamedTuple):
    """The encoders as the controller sees them, (J,) each.

    Last reading (``angle``), low-passed ``speed``, their errors, and ``reading`` as scratch.
    """

    angle: np.ndarray
    speed: np.ndarray
    angle_error: np.ndarray
    speed_error: np.ndarray
    reading: np.ndarray


class _Kept(NamedTuple):
    """State at the start of a step, and its references and disturbance."""

    state: np.ndarray
    memory: np.ndarray
    load: np.ndarray
    weights: np.ndarray
    wanted: np.ndarray
    disturbance: np.ndarray


class _Loop(NamedTuple):
    """A loop during a simulation: model, controller, scratch and state.

    ``drive`` (4, J) is scratch for torques.
    """

    a: Assembly
    c: RbfController
    w: Workspace
    s: Stages
    net: _Network
    seen: _Seen
    state: np.ndarray
    memory: np.ndarray
    load: np.ndarray
    weights: np.ndarray
    drive: np.ndarray


LOOP = types.NamedTuple(
    [
        ASSEMBLY,
        typeof(RbfController(1.0, 1.0, 1.0, 1.0, 1.0, np.zeros(1), 1.0)),
        WORKSPACE,
        STAGES,
        typeof(_Network(np.zeros((4, 1, 1)), np.zeros((1, 1)), np.zeros(1))),
        typeof(_Seen(*np.zeros((5, 1)))),
        *(states, vector, vector, states, states),
    ],
    _Loop,
)


@njit(**INNER)
def _control(c, seen, net, state, wanted, weights, torque, network, weight_rates):
    """Write torque and network output (J,) and the weights' rates (J, m) for ``wanted`` (3, J)."""
    sharpness = 1.0 / (c.width * c.width)
    for j in range(torque.shape[0]):
        q, dq, ddq = wanted[0, j], wanted[1, j], wanted[2, j]
        # A reading's error is held until the next sample, while the angle moves in each stage.
        e = q - state[THETA, j] - seen.angle_error[j]
        de = dq - state[DTHETA, j] - seen.speed_error[j]
        r = de + c.error_gain * e
        network[j] = 0.0
        # |x - c|² expanded, because a centre has equal coordinates in all five directions.
        # Over five inputs: |x|² - 2 node sum(x) + 5 node².
        sum_of_inputs = e + de + q + dq + ddq
        sum_of_squares = e * e + de * de + q * q + dq * dq + ddq * ddq
        for i in range(c.nodes.shape[0]):
            distance = sum_of_squares + c.nodes[i] * (5.0 * c.nodes[i] - 2.0 * sum_of_inputs)
            net.activation[i] = np.exp(-distance * sharpness)
            network[j] += weights[j, i] * net.activation[i]
        demand = network[j] + c.feedback_gain * r + c.robust_gain * np.sign(r)
        torque[j] = min(c.limit, max(-c.limit, demand))
        # The limit makes an error that no weight can reduce, on which the weights would wind up.
        rate = c.adaptation_gain * r if torque[j] == demand else 0.0
        for i in range(c.nodes.shape[0]):
            weight_rates[j, i] = rate * net.activation[i]


@njit(cache=True, inline="always")
def _keeps_going(direction, state):
    """Return whether every motor moves in its friction's direction, or is held by friction."""
    # Greatest speed of a moving joint against its direction of friction, rad/s.
    rounding = 1e-6
    # Greatest speed of a joint that friction holds, rad/s: torque changes within a step.
    creep = 1e-3
    agrees = True
    for j in range(direction.shape[0]):
        v = state[DTHETA, j]
        agrees &= v * direction[j] >= -rounding if abs(direction[j]) == 1.0 else abs(v) < creep
    return agrees


@compiled_once(boolean(LOOP, float64, float64, float64[:, :, ::1], states, vector, vector))
def _step(loop, t, h, wanted, disturbance, torque, network):
    """Advance leg and weights by ``h``; return whether nothing switched.

    A switch is a joint that turns, or a torque that reaches or leaves its limit. ``wanted`` (3, 3,
    J) and ``disturbance`` (3, J) are given at start, middle and end. Torque and network output at
    the start are written to ``torque`` and ``network`` (J,).
    """
    a, c, w, s, net, seen = loop.a, loop.c, loop.w, loop.s, loop.net, loop.seen
    state, memory, load, weights = loop.state, loop.memory, loop.load, loop.weights
    drive = loop.drive
    _control(c, seen, net, state, wanted[0], weights, torque, network, net.rates[0])
    for j in range(a.joints):
        # The disturbance acts against the drives (paper, eq. 13).
        drive[0, j] = torque[j] - disturbance[0, j]
    find_direction(a, w, t, h, state, memory, load, drive[0], s.rates[0])
    smooth = _keeps_going(w.direction, state)
    begin_stages(a, w, s, t, state, memory, load)
    for i in range(1, 4):
        # Stages 1 and 2 are in the middle of the step, stage 3 at its end.
        half_steps = 2 if i == 3 else 1
        reach = 0.5 * h * half_steps
        reach_stage(s, i, reach, state, memory)
        for j in range(a.joints):
            for k in range(weights.shape[1]):
                net.stage[j, k] = weights[j, k] + reach * net.rates[i - 1, j, k]
        now = wanted[half_steps]
        _control(c, seen, net, s.state, now, net.stage, drive[0], drive[3], net.rates[i])
        for j in range(a.joints):
            # A torque that reaches or leaves its limit has a kink, as at a joint's reversal.
            smooth &= (abs(drive[0, j]) == c.limit) == (abs(torque[j]) == c.limit)
            drive[0, j] -= disturbance[half_steps, j]
        accelerations(a, w, t + reach, s.state, s.memory, w.direction, load, drive[0], s.rates[i])
        memory_rates(a, w, t + reach, s.state, s.memory, w.direction, load, s.memory_rates[i])
    end_stages(s, h, state, memory)
    for j in range(a.joints):
        for k in range(weights.shape[1]):
            weights[j, k] += h / 6.0 * weighted(net.rates[:, j, k])
    return smooth and _keeps_going(w.direction, state)


@njit(cache=True, inline="always")
def _copy(source, target):
    """Copy state, memory, load and weights from a loop to what is kept of it, or back."""
    for j in range(source.load.shape[0]):
        target.load[j] = source.load[j]
        for row in range(4):
            target.state[row, j] = source.state[row, j]
        for k in range(source.weights.shape[1]):
            target.weights[j, k] = source.weights[j, k]
    for m in range(source.memory.shape[0]):
        target.memory[m] = source.memory[m]


@njit(cache=True, inline="always")
def _within(wanted, disturbance, begin, length, kept):
    """Write references and disturbance of a part of a step, interpolated by parabolas."""
    for i in range(3):
        x = begin + 0.5 * i * length
        # Lagrange's polynomials for the start, the middle and the end of the whole step.
        first, middle, last = (1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)
        for j in range(wanted.shape[2]):
            kept.disturbance[i, j] = (
                first * disturbance[0, j] + middle * disturbance[1, j] + last * disturbance[2, j]
            )
            for k in range(3):
                kept.wanted[i, k, j] = (
                    first * wanted[0, k, j] + middle * wanted[1, k, j] + last * wanted[2, k, j]
                )


@njit(**INNER)
def _advance(loop, kept, t, h, wanted, disturbance, torque, network):
    """Advance like ``_step``, but halve a part in which something switches."""
    # Parts into which a step with a switch can be divided, a power of two.
    parts = 256
    done, size = 0, parts
    while done < parts:
        # A step in which something switches is taken back and divided.
        _copy(loop, kept)
        begin, length = t + done * h / parts, size * h / parts
        if size == parts:
            smooth = _step(loop, begin, length, wanted, disturbance, torque, network)
        else:
            _within(wanted, disturbance, done / parts, size / parts, kept)
            # The first try wrote torque and network output at the step's start already.
            unused = loop.drive[1], loop.drive[2]
            smooth = _step(loop, begin, length, kept.wanted, kept.disturbance, unused[0], unused[1])
        if smooth or size == 1:
            done += size
            # Parts grow again where a part of twice the size may begin.
            while size < parts and done % (2 * size) == 0:
                size *= 2
        else:
            _copy(kept, loop)
            size //= 2


@njit(**INNER)
def _look(loop, encoder, k, period):
    """Read the encoders at sample ``k``, and update the errors of angle and speed."""
    seen, state = loop.seen, loop.state
    for j in range(loop.a.joints):
        seen.reading[j] = state[THETA, j]
    read_encoders(loop.a, seen.reading)
    for j in range(loop.a.joints):
        angle = seen.reading[j]
        if encoder.noise.shape[0] > 0:
            angle += encoder.noise[k, j]
            angle = whole_counts(angle, encoder.rad_per_count)
            if k > 0:
                change = (angle - seen.angle[j]) / period - seen.speed[j]
                seen.speed[j] += encoder.speed_share * change
            seen.speed_error[j] = seen.speed[j] - state[DTHETA, j]
        seen.angle[j] = angle
        seen.angle_error[j] = angle - state[THETA, j]


@njit(**ALLOCATING_NOTHING)
def _run(loop, kept, encoder, reference, disturbance, period, substeps, out):
    """Simulate samples into ``out`` (n, 4, J), and return their number.

    A joint that runs away ends the simulation.
    """
    net, state, drive = loop.net, loop.state, loop.drive
    h = period / substeps
    last = out.shape[0] - 1
    for k in range(out.shape[0]):
        _look(loop, encoder, k, period)
        ends = k == last
        for j in range(loop.a.joints):
            out[k, 0, j], out[k, 1, j] = state[THETA, j], state[DTHETA, j]
            # NaN ends the simulation as well.
            ends |= not abs(state[THETA, j]) < TURN
        torque, network = out[k, 2], out[k, 3]
        at = 2 * k * substeps
        if ends:
            wanted, rates = reference[at], net.rates[0]
            _control(loop.c, loop.seen, net, state, wanted, loop.weights, torque, network, rates)
            break
        for i in range(substeps):
            now = slice(at + 2 * i, at + 2 * i + 3)
            begin = k * period + i * h
            if i > 0:
                # Results hold the torque at a sample's start; later steps write to scratch.
                torque, network = drive[1], drive[2]
            _advance(loop, kept, begin, h, reference[now], disturbance[now], torque, network)
    return k + 1


def _of_floats(controller: RbfController) -> RbfController:
    """Return a controller with the types that were compiled."""
    values: list[Any] = [value if np.ndim(value) else float(value) for value in controller]
    return RbfController(*values)


class RbfRun(NamedTuple):
    """A simulated closed loop at n samples of J joints."""

    angle: NDArray
    """(n, J) angle of the motors, rad."""
    speed: NDArray
    torque: NDArray
    """(n, J) torque of the drives without the disturbance, N·m."""
    network: NDArray
    """(n, J) N·m."""


def follow_with_rbf(
    a: Assembly,
    controller: RbfController,
    encoder: Encoder,
    reference: NDArray,
    disturbance: NDArray,
    period: float,
    start: NDArray,
    substeps: int = 1,
) -> RbfRun:
    """Simulate a leg along a reference under the adaptive controller, from rest with zero weights.

    Parameters
    ----------
    a : Assembly
        Model.
    controller : RbfController
        Gains and network.
    encoder : Encoder
        Readings of the angles.
    reference : (2 (n - 1) substeps + 1, 3, J) array
        Reference angle, velocity and acceleration at every half integration step.
    disturbance : (2 (n - 1) substeps + 1, J) array
        Torque against the drives (paper, eq. 13), N·m, at every half step.
    period : float
        Time between two samples, s.
    start : (J,) array
        Angle at rest, rad.
    substeps : int
        Integration steps per sample.

    Returns
    -------
    RbfRun
        n samples; fewer if a joint leaves ± one turn, in the last sample.
    """
    n, joints, m = (len(reference) - 1) // (2 * substeps) + 1, a.joints, len(controller.nodes)
    memories, weights = memory_size(a), np.zeros((joints, m))
    loop = _Loop(
        a,
        _of_floats(controller),
        workspace(joints),
        stages(joints, memories),
        _Network(np.zeros((4, joints, m)), weights.copy(), np.zeros(m)),
        _Seen(*np.zeros((5, joints))),
        resting_state(start),
        np.zeros(memories),
        np.zeros(joints),
        weights,
        np.zeros((4, joints)),
    )
    kept = _Kept(
        state=np.zeros((4, joints)),
        memory=np.zeros(memories),
        load=np.zeros(joints),
        weights=np.zeros((joints, m)),
        wanted=np.zeros((3, 3, joints)),
        disturbance=np.zeros((3, joints)),
    )
    out = np.empty((n, 4, joints))
    reference, disturbance = np.ascontiguousarray(reference), np.ascontiguousarray(disturbance)
    reached = _run(loop, kept, encoder, reference, disturbance, period, substeps, out)
    return RbfRun(*(out[:reached, i] for i in range(4)))
