"""Replay: a model under the recorded torque, from the recorded state, over short windows.

The angle error over a window is the error of a model as a controller sees it. Short windows keep
small errors of the recorded state from growing into large ones.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.dynamics.assembly import assemble
from pipelines.dynamics.forward import (
    DTHETA,
    INNER,
    THETA,
    memory_rates,
    memory_size,
    stages,
    step,
    workspace,
)
from pipelines.effects.kernel import ALLOCATING_NOTHING
from pipelines.errors import InputError
from pipelines.mechanics.instant import REFERENCE_C
from pipelines.mechanics.motion import Motion
from pipelines.model import Model

WINDOW_S = 1.0


@dataclass(frozen=True)
class ReplayResult:
    """Simulated windows of a motion: w windows of n samples, J joints."""

    first: NDArray
    """(w,) first sample of each window in the motion."""
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


def replay(
    model: Model, motion: Motion, window_s: float = WINDOW_S, every_s: float = 0.5
) -> ReplayResult:
    """Simulate a model under the recorded torque, from the recorded state, over short windows.

    Windows lie within stretches of valid samples. Each torque sample holds from half a sample
    before its time to half a sample after, like a mean over that time.

    Parameters
    ----------
    model : Model
        Terms for another kind of run than the motion's are ignored.
    motion : Motion
        Recorded motion.
    window_s : float
        Length of a window, s.
    every_s : float
        Time from the start of one window to that of the next, s.

    Raises
    ------
    InputError
        If no stretch of valid samples is as long as a window, or a torque was not measured.
    """
    motion.machine.refuse_unmeasured(motion.file or "the motion", "A simulation")
    longest_step_s = 0.0025
    length = round(window_s * motion.sample_rate_hz)
    every = max(1, round(every_s * motion.sample_rate_hz))
    first = np.array(
        [k for s in _stretches(motion) for k in range(s.start, s.stop - length, every)],
        dtype=np.int64,
    )
    if first.size == 0:
        raise InputError(
            f"{motion.file or 'the motion'}: no stretch of valid samples lasts the {window_s:g} s"
            " of a window; replay a longer recording without gaps"
        )
    model = model.for_run(motion.run)
    a = assemble(model, motion.geometry, motion.joints)
    motor = model.sensed(motion)
    link = model.behind_motors(motor)
    # Rows of a state (Q, DQ, THETA, DTHETA): links behind compliant joints move differently.
    states = np.ascontiguousarray(np.stack([link.q, link.dq, motor.q, motor.dq], axis=1))
    load = np.ascontiguousarray(motor.transmitted[0])
    temperature = known_temperature(motion)
    memory = np.zeros((len(motion), memory_size(a)))
    w, s = workspace(a.joints), stages(a.joints, memory.shape[1])
    for stretch in motion.segments():
        recorded = (x[stretch] for x in (motion.time, states, load, temperature, memory))
        _remember(a, w, s, *recorded)
    torque = np.ascontiguousarray(model.delivered(motor))
    # Steps in half a sample, because the torque changes half way between samples.
    parts = int(np.ceil(0.5 / (motion.sample_rate_hz * longest_step_s)))
    out = np.empty((len(first), length + 1, 2, a.joints))
    for k, window in zip(first, out, strict=True):
        # A motor hardly warms within a window.
        a.temperature[:] = temperature[k]
        start = states[k].copy(), memory[k].copy(), load[k].copy()
        try:
            _window(a, w, s, motion.time[k:], torque[k:], parts, *start, window)
        except ZeroDivisionError:  # at such speeds rounding leaves no mass
            window[:] = np.nan
    samples = first[:, np.newaxis] + np.arange(length + 1)
    # Errors are those of the motors' angles, after the encoders' own errors were removed.
    return ReplayResult(first, out[:, :, 0], out[:, :, 1], motor.q[samples] - out[:, :, 0])


def known_temperature(motion: Motion) -> NDArray:
    """Return the motors' temperature, and the reference where it was not measured.

    Parameters
    ----------
    motion : Motion
        n samples of J joints.

    Returns
    -------
    (n, J) array
        °C.
    """
    return np.nan_to_num(motion.interpolated_temperature, nan=REFERENCE_C)


def _stretches(motion: Motion) -> Iterator[slice]:
    """Yield each stretch of valid samples within a segment."""
    for segment in motion.segments():
        inside = np.concatenate([[False], motion.valid[segment], [False]])
        edges = segment.start + np.flatnonzero(np.diff(inside.astype(int)))
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            yield slice(int(start), int(stop))


@njit(**INNER)
def _recall(a, w, s, time, states, load, k, share, memory):
    """Write the memories' rates between samples ``k`` and k + 1 into the first of ``s``."""
    for j in range(a.joints):
        w.passed[j] = load[k, j] + share * (load[k + 1, j] - load[k, j])
        for row in range(4):
            s.state[row, j] = states[k, row, j] + share * (
                states[k + 1, row, j] - states[k, row, j]
            )
        # The recorded motion is given, so that no joint has to be held by friction.
        w.direction[j] = np.sign(s.state[DTHETA, j])
    t = time[k] + share * (time[k + 1] - time[k])
    memory_rates(a, w, t, s.state, memory, w.direction, w.passed, s.memory_rates[0])


@njit(**ALLOCATING_NOTHING)
def _remember(a, w, s, time, states, load, temperature, memory):
    """Write the memories along a recorded stretch (n, 4, J), from rest, into ``memory`` (n, m)."""
    # Steps per sample of the effects' memories along the recorded motion, as in the regression.
    memory_substeps = 8
    for k in range(len(time) - 1 if memory.shape[1] > 0 else 0):
        for j in range(a.joints):
            a.temperature[j] = temperature[k, j]
        for m in range(memory.shape[1]):
            memory[k + 1, m] = memory[k, m]
        h = (time[k + 1] - time[k]) / memory_substeps
        for i in range(memory_substeps):
            # Midpoint rule: half a step to the middle, then a whole step with the rate there.
            _recall(a, w, s, time, states, load, k, i / memory_substeps, memory[k + 1])
            for m in range(memory.shape[1]):
                s.memory[m] = memory[k + 1, m] + 0.5 * h * s.memory_rates[0, m]
            _recall(a, w, s, time, states, load, k, (i + 0.5) / memory_substeps, s.memory)
            for m in range(memory.shape[1]):
                memory[k + 1, m] += h * s.memory_rates[0, m]


@njit(**ALLOCATING_NOTHING)
def _window(a, w, s, time, torque, parts, state, memory, load, out):
    """Simulate one window from ``state`` on into ``out`` (n, 2, J)."""
    _note(state, out[0])
    for k in range(out.shape[0] - 1):
        # The torque of a sample holds half way to the next.
        h = 0.5 * (time[k + 1] - time[k]) / parts
        for part in range(2 * parts):
            step(a, w, s, time[k] + part * h, h, state, memory, load, torque[k + part // parts])
        _note(state, out[k + 1])


@njit(cache=True, inline="always")
def _note(state, out):
    for j in range(out.shape[1]):
        out[0, j], out[1, j] = state[THETA, j], state[DTHETA, j]
