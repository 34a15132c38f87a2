"""A delayed torque channel."""

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side
from pipelines.effects.kernel import torque_reading
from pipelines.mechanics.motion import Motion

SLOTS = 128
"""Samples that the channel remembers; it limits the delay."""


class TimeDelay(Effect):
    """The measured torque is that of some milliseconds before, due to a filter or a bus."""

    name = "time_delay"
    title = "Time delay"
    side = Side.SENSOR
    family = Family.SENSOR
    needs_torque = True
    resembles = ("load", "speed", "inertia_by_angle")
    forms_differ = "a real channel is a filter, whose delay depends on the frequency"
    equation = "measured torque(t) = true torque(t - delay)"
    source = (
        "Björklund (2003), A Survey and Comparison of Time-Delay Estimation Methods in Linear"
        " Systems, Linköping"
    )
    looks_like = (
        "residual in step with the torque's rate of change; friction steps smeared to one side of"
        " reversals"
    )
    confirm = "knock on the link and compare the times at which torque and encoder respond"
    shape = (Parameter("delay", "s", "delay of the torque channel", "T", (0.0, 0.06)),)
    reading_states = 1 + 2 * SLOTS

    @torque_reading
    def torque_reading(t, torque, values, joint, state, temperature):
        """Return the delayed torque, linear between samples; at first that of the first sample."""
        # Memory: the number of samples so far, then a ring of times and torques.
        newest = int(state[0])
        state[0] += 1.0
        slot = 1 + 2 * (newest % SLOTS)
        state[slot], state[slot + 1] = t, torque[joint]
        then = t - values[0]
        k = newest
        # Backwards to the last sample that is old enough.
        while k > max(0, newest - SLOTS + 1) and state[1 + 2 * (k % SLOTS)] > then:
            k -= 1
        before, after = 1 + 2 * (k % SLOTS), 1 + 2 * (min(k + 1, newest) % SLOTS)
        torque[joint] = state[before + 1]
        # Without a delay the newest sample is the reading, and no later one exists.
        if state[before] < then and after != before:
            share = (then - state[before]) / (state[after] - state[before])
            torque[joint] += share * (state[after + 1] - state[before + 1])

    def delivered(self, torque: NDArray, motion: Motion, values: NDArray) -> NDArray:
        """Shift the torque, (n, J) N·m, earlier; each stretch ends with its last sample."""
        true, j = torque.copy(), self.column(motion)
        for stretch in motion.segments():
            time = motion.time[stretch]
            true[stretch, j] = np.interp(time + values[0], time, torque[stretch, j])
        return true
