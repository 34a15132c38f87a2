"""The leg under its drives' own position loops: sampled PD control of encoder counts.

The same loop moves the virtual rig sample by sample, and replays a recording along its references.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.dynamics.assembly import Assembly
from pipelines.dynamics.forward import (
    DQ,
    THETA,
    Q,
    memory_size,
    resting_state,
    stages,
    step,
    workspace,
)
from pipelines.effects.kernel import ALLOCATING_NOTHING, reading_at, torque_reading_at

SUBSTEPS = 6
"""Integration steps per control period; even, so that the middle of a sample is one of them."""


class Drives(NamedTuple):
    """Position controllers of all joints.

    torque = kp (reference - angle) + kd (its rate - speed), limited. The reference is linear from
    one set-point to the next; speed is the low-passed difference of the counted angle.
    """

    kp: np.ndarray
    """(J,) N·m/rad."""
    kd: np.ndarray
    """(J,) N·m·s/rad."""
    limit: np.ndarray
    """(J,) N·m."""
    rad_per_count: np.ndarray
    """(J,) resolution of the encoder; 0 for an ideal one."""
    speed_share: float
    """Share of a new speed in the low-passed one at each control period, (0, 1]."""
    periods: int
    """Control periods per sample."""
    step_s: float
    """Integration step, s."""


def make_drives(
    kp: NDArray,
    kd: NDArray,
    limit: NDArray,
    counts_per_turn: NDArray,
    rate_hz: float,
    sample_rate_hz: float,
) -> Drives:
    """Return the drives for the compiled loop.

    Parameters
    ----------
    kp, kd, limit : (J,) array
        Gains, N·m/rad and N·m·s/rad, and greatest torque, N·m.
    counts_per_turn : (J,) array
        Resolution of the encoders; 0 for an ideal one.
    rate_hz : float
        Rate of the control loop; it is rounded to a multiple of the sample rate.
    sample_rate_hz : float
        Sample rate.
    """
    # Cut-off of the speed's low-pass.
    speed_cutoff_hz = 100.0
    periods = max(1, round(rate_hz / sample_rate_hz))
    period = 1.0 / (sample_rate_hz * periods)
    counts = np.asarray(counts_per_turn, float)
    return Drives(
        kp=np.asarray(kp, float),
        kd=np.asarray(kd, float),
        limit=np.asarray(limit, float),
        rad_per_count=np.divide(2 * np.pi, counts, out=np.zeros_like(counts), where=counts > 0),
        # A first-order low-pass, exact for an input that is constant over each period.
        speed_share=float(1.0 - np.exp(-2 * np.pi * speed_cutoff_hz * period)),
        periods=periods,
        step_s=period / SUBSTEPS,
    )


class LoopState(NamedTuple):
    """The variables of the running loop."""

    state: np.ndarray
    """(4, J) links and motors."""
    memory: np.ndarray
    load: np.ndarray
    angle: np.ndarray
    """(J,) last counted angle."""
    speed: np.ndarray
    """(J,) speed as the drive estimates it."""
    torque: np.ndarray
    """(J,) torque that the drives apply."""
    reference: np.ndarray
    """(J,) last set-point."""
    sensed: np.ndarray
    """Memory of the torque sensors."""


def loop_at_rest(a: Assembly, q: NDArray) -> LoopState:
    """Return the loop with the leg at rest and the set-point there.

    Parameters
    ----------
    a : Assembly
        Effects of J joints.
    q : (J,) array
        Link angles, rad.

    Returns
    -------
    LoopState
        Speeds, torques and memories are zero.
    """
    q = np.asarray(q, float)
    angle = q.copy()
    read_encoders(a, angle)
    return LoopState(
        state=resting_state(q),
        memory=np.zeros(memory_size(a)),
        load=np.zeros(a.joints),
        angle=angle,
        speed=np.zeros(a.joints),
        torque=np.zeros(a.joints),
        reference=angle.copy(),
        sensed=np.zeros(int(a.sensed_at[-1])),
    )


@njit(**ALLOCATING_NOTHING)
def read_encoders(a, angle):
    """Turn true motor angles into the encoders' readings.

    Parameters
    ----------
    a : Assembly
        Effects of J joints.
    angle : (J,) array
        rad; changed in place.
    """
    # All terms, most of which have a kernel that changes nothing.
    for i in range(a.bounds[4]):
        reading_at(a.readings[i])(angle, a.values[a.value_at[i] : a.value_at[i + 1]], a.joint[i])


@njit(cache=True, inline="always")
def whole_counts(angle, rad_per_count):
    """Return an angle rounded to counts of an encoder; unchanged for an ideal encoder."""
    return np.floor(angle / rad_per_count + 0.5) * rad_per_count if rad_per_count > 0.0 else angle


@njit(cache=True)
def _read_torque(a, t, torque, sensed):
    """Turn delivered torques into the sensors' readings, in place; once per sample, in order."""
    for i in range(a.bounds[4]):
        values = a.values[a.value_at[i] : a.value_at[i + 1]]
        state = sensed[a.sensed_at[i] : a.sensed_at[i + 1]]
        torque_reading_at(a.torque_readings[i])(t, torque, values, a.joint[i], state, a.temperature)


@njit(cache=True)
def _copy(source, out):
    """Copy an array (J,); ``out[:] = source`` takes seconds to compile, for its error's message."""
    for j in range(out.shape[0]):
        out[j] = source[j]


@njit(cache=True)
def advance(a, d, w, s, loop, t, reference, enabled, angle, speed, torque, truth):
    """Advance the loop by one sample period that begins at ``t``.

    Parameters
    ----------
    a, d, w, s, loop
        Assembly, Drives, workspace, stages, LoopState.
    t : float
        Time, s.
    reference : (J,) array
        Set-point to be reached at the end of the period, rad.
    enabled : (J,) bool array
        False for a drive that applies no torque.
    angle, speed, torque : (J,) array, written
        Measured angle and the drive's speed in the middle of the period, mean torque over it.
    truth : (4, J) array, written
        Link angle, speed, acceleration and motor angle in the middle of the period.
    """
    j_count = a.joints
    begin = loop.reference.copy()
    torque[:] = 0.0
    counted = np.zeros(j_count)
    period = d.step_s * SUBSTEPS
    # A sample's time is the middle of the window over which its torque is a mean.
    middle = d.periods * SUBSTEPS // 2
    done = 0
    for c in range(d.periods):
        _copy(loop.state[THETA], counted)
        read_encoders(a, counted)
        for j in range(j_count):
            counted[j] = whole_counts(counted[j], d.rad_per_count[j])
            loop.speed[j] += d.speed_share * ((counted[j] - loop.angle[j]) / period - loop.speed[j])
            loop.angle[j] = counted[j]
            # Linear between set-points, or each of them would be a step of torque.
            wanted = begin[j] + (reference[j] - begin[j]) * c / d.periods
            rate = (reference[j] - begin[j]) / (period * d.periods)
            command = d.kp[j] * (wanted - counted[j]) + d.kd[j] * (rate - loop.speed[j])
            loop.torque[j] = min(d.limit[j], max(-d.limit[j], command)) if enabled[j] else 0.0
        for _ in range(SUBSTEPS):
            if done == middle:
                _copy(loop.state[THETA], angle)
                read_encoders(a, angle)
                for j in range(j_count):
                    angle[j] = whole_counts(angle[j], d.rad_per_count[j])
                _copy(loop.speed, speed)
                _copy(loop.state[Q], truth[0])
                _copy(loop.state[DQ], truth[1])
                _copy(loop.state[THETA], truth[3])
            now = t + done * d.step_s
            step(a, w, s, now, d.step_s, loop.state, loop.memory, loop.load, loop.torque)
            if done == middle:
                # The first stage is the acceleration at this step's start, the sample's middle.
                _copy(s.rates[0, DQ], truth[2])
            done += 1
        for j in range(j_count):
            torque[j] += loop.torque[j] / d.periods
    # The sensor acts on the mean, once per sample, as along a recorded motion.
    _read_torque(a, t + middle * d.step_s, torque, loop.sensed)
    _copy(reference, loop.reference)


def follow(
    a: Assembly,
    d: Drives,
    loop: LoopState,
    reference: NDArray,
    start_s: float,
    temperature: NDArray | None = None,
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Run the loop along set-points.

    Parameters
    ----------
    a : Assembly
        Model.
    d : Drives
        Controllers.
    loop : LoopState
        State at the start; it is advanced.
    reference : (n, J) array
        Set-points, rad.
    start_s : float
        Time of the first sample, s.
    temperature : (n, J) array, optional
        Temperature of the motors, °C; by default that of ``a``.

    Returns
    -------
    angle, speed, torque : (n, J) array
        Measured values of each sample.
    truth : (n, 4, J) array
        Link angle, speed, acceleration and motor angle of each sample.
    """
    n, joints = reference.shape
    angle, speed, torque = np.empty((n, joints)), np.empty((n, joints)), np.empty((n, joints))
    truth = np.empty((n, 4, joints))
    warmth = np.tile(a.temperature, (n, 1)) if temperature is None else temperature
    scratch = workspace(joints), stages(joints, len(loop.memory))
    enabled = np.ones(joints, dtype=bool)
    _follow(a, d, *scratch, loop, reference, start_s, warmth, enabled, angle, speed, torque, truth)
    return angle, speed, torque, truth


@njit(cache=True)
def _follow(
    a, d, w, s, loop, reference, start_s, temperature, enabled, angle, speed, torque, truth
):
    period = d.step_s * SUBSTEPS * d.periods
    for k in range(len(reference)):
        a.temperature[:] = temperature[k]
        t = start_s + k * period
        advance(a, d, w, s, loop, t, reference[k], enabled, angle[k], speed[k], torque[k], truth[k])
