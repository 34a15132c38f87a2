"""A model under recorded torque, from the recorded state, over short windows: how far it strays.

The angle error over a window is what control feels of a wrong model; short windows keep the small
errors of the recorded state from growing into large ones.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.dynamics.assembly import assemble
from pipelines.dynamics.forward import DTHETA, HOT, THETA, memory_rates, memory_size, stages, step, workspace
from pipelines.errors import InputError
from pipelines.mechanics.instant import REFERENCE_C
from pipelines.mechanics.motion import Motion
from pipelines.model import Model

WINDOW_S = 1.0
EVERY_S = 0.5

LONGEST_STEP_S = 0.0025
MEMORY_SUBSTEPS = 8
"""Steps per sample of the effects' memories along the recorded motion, as in the regression."""


@dataclass(frozen=True)
class ReplayResult:
    """Simulated windows of a motion: w windows of n samples, J joints."""

    first: NDArray
    """(w,) sample of the motion at which each window starts."""
    angle: NDArray
    """(w, n, J) simulated angle of the motors, rad."""
    velocity: NDArray
    """(w, n, J) rad/s."""
    error: NDArray
    """(w, n, J) recorded less simulated angle, rad."""

    @property
    def rmse(self) -> NDArray:
        """RMS of the angle error over all windows, (J,) rad."""
        return np.sqrt(np.mean(self.error**2, axis=(0, 1)))


def replay(model: Model, motion: Motion, window_s: float = WINDOW_S, every_s: float = EVERY_S) -> ReplayResult:
    """Drive a model by the recorded torque from the recorded state, over windows within each segment.

    Windows lie within stretches of valid samples. A torque sample holds from half a sample before its time to
    half a sample after it, as a mean over that time does.

    Parameters
    ----------
    model : Model
        Its terms for another kind of run than the motion's are left out.
    motion : Motion
    window_s, every_s : float
        Length of a window and time from one start to the next, s.

    Raises
    ------
    InputError
        Where no stretch of valid samples is as long as a window.
    """
    length = round(window_s * motion.sample_rate_hz)
    every = max(1, round(every_s * motion.sample_rate_hz))
    first = np.array([k for s in _stretches(motion) for k in range(s.start, s.stop - length, every)], dtype=np.int64)
    if first.size == 0:
        raise InputError(
            f"{motion.file or 'the motion'}: no stretch of valid samples lasts the {window_s:g} s of a window; "
            "replay a longer recording without gaps"
        )
    model = model.for_run(motion.run)
    a = assemble(model, motion.geometry, motion.joints)
    motor = model.sensed(motion)
    link = model.behind_motors(motor)
    states = np.ascontiguousarray(np.stack([link.q, link.dq, motor.q, motor.dq], axis=1))
    load = np.ascontiguousarray(motor.transmitted[0])
    temperature = known_temperature(motion)
    memory = np.zeros((len(motion), memory_size(a)))
    for stretch in motion.segments():
        _remember(
            a, motion.time[stretch], states[stretch], load[stretch], temperature[stretch], memory[stretch]
        )  # fmt: skip
    torque = np.ascontiguousarray(model.delivered(motor))
    parts = int(np.ceil(0.5 / (motion.sample_rate_hz * LONGEST_STEP_S)))
    out = _windows(a, motion.time, states, load, temperature, memory, torque, first, length, parts)
    samples = first[:, np.newaxis] + np.arange(length + 1)
    return ReplayResult(first, out[:, :, 0], out[:, :, 1], motor.q[samples] - out[:, :, 0])


def known_temperature(motion: Motion) -> NDArray:
    """Return the motors' temperature along a motion, (n, J) °C: the reference where it was not read."""
    return np.nan_to_num(motion.motor_temperature, nan=REFERENCE_C)


def _stretches(motion: Motion) -> Iterator[slice]:
    """Yield each stretch of valid samples within a segment."""
    for segment in motion.segments():
        inside = np.concatenate([[False], motion.valid[segment], [False]])
        edges = segment.start + np.flatnonzero(np.diff(inside.astype(int)))
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            yield slice(int(start), int(stop))


@njit(cache=True)
def _remember(a, time, states, load, temperature, memory):
    """Write the memories along a recorded stretch (n, 4, J), from rest at its first sample, into ``memory`` (n, m)."""
    w = workspace(a.joints)
    rate, middle = np.zeros(memory.shape[1]), np.zeros(memory.shape[1])
    state, passed = states[0].copy(), load[0].copy()
    for k in range(len(time) - 1 if memory.shape[1] > 0 else 0):
        memory[k + 1] = memory[k]
        a.temperature[:] = temperature[k]
        h = (time[k + 1] - time[k]) / MEMORY_SUBSTEPS
        for i in range(2 * MEMORY_SUBSTEPS):
            share = 0.5 * i / MEMORY_SUBSTEPS
            state[:] = states[k] + share * (states[k + 1] - states[k])
            passed[:] = load[k] + share * (load[k + 1] - load[k])
            t = time[k] + share * (time[k + 1] - time[k])
            w.direction[:] = np.sign(state[DTHETA])
            # The midpoint rule: half a step for the rate in the middle, a whole one with it.
            if i % 2 == 0:
                memory_rates(a, w, t, state, memory[k + 1], w.direction, passed, rate)
                middle[:] = memory[k + 1] + 0.5 * h * rate
            else:
                memory_rates(a, w, t, state, middle, w.direction, passed, rate)
                memory[k + 1] += h * rate


@njit(cache=True)
def _windows(a, time, states, load, temperature, memory, torque, first, length, parts):
    """Simulate every window: motor angle and speed, (windows, length + 1, 2, J)."""
    out = np.empty((len(first), length + 1, 2, a.joints))
    w, s = workspace(a.joints), stages(a.joints, memory.shape[1])
    state, remembered, passed = np.empty((4, a.joints)), np.empty(memory.shape[1]), np.empty(a.joints)
    for window in range(len(first)):
        k = first[window]
        state[:], remembered[:], passed[:] = states[k], memory[k], load[k]
        a.temperature[:] = temperature[k]
        _window(a, w, s, time[k:], torque[k:], parts, state, remembered, passed, out[window])
    return out


@njit(**HOT)
def _window(a, w, s, time, torque, parts, state, memory, load, out):
    """Simulate one window from ``state`` on into ``out`` (n, 2, J)."""
    _note(state, out[0])
    for k in range(out.shape[0] - 1):
        # The torque of one sample up to half way to the next, then the next one's.
        h = 0.5 * (time[k + 1] - time[k]) / parts
        for part in range(2 * parts):
            step(a, w, s, time[k] + part * h, h, state, memory, load, torque[k + part // parts])
        _note(state, out[k + 1])


@njit(cache=True, inline="always")
def _note(state, out):
    for j in range(out.shape[1]):
        out[0, j], out[1, j] = state[THETA, j], state[DTHETA, j]
