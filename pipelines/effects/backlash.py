"""Play between motor and link."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Parameter, Side
from pipelines.effects.joint_elasticity import MOTOR_INERTIA
from pipelines.effects.kernel import spring
from pipelines.mechanics.motion import Motion

CONTACT_STIFFNESS = 30000.0
"""N·m/rad of teeth in contact; stiff against every joint, soft enough for the integration step."""

CONTACT_DAMPING_RATIO = 0.3
"""Of the motor's swing on its teeth."""

CROSSING_TORQUE = 2.0
"""N·m on both sides of zero over which a measured motion crosses the play: the link does not jump, it swings over."""


class Backlash(Effect):
    """The link hangs on that side of the play towards which the torque pushes it."""

    name = "backlash"
    title = "Backlash"
    side = Side.DRIVE
    equation = "load angle = motor angle - play / 2 * sgn(transmitted torque)"
    source = "Nordin, Gutman (2002), Automatica 38(10): controlling mechanical systems with backlash, sec. 2"
    looks_like = "bursts of torque at 4 to 25 Hz wherever the load changes sign, and gravity that jumps there"
    confirm = "hold the motor and shake the link by hand: it moves freely by the play"
    shape = (Parameter("play", "rad", "free travel from stop to stop", "p", (0.003, 0.06)),)
    motor_inertia = MOTOR_INERTIA

    @spring
    def spring(twist, twist_rate, values):
        """Return nothing within the play; beyond it teeth that push and never pull."""
        half = 0.5 * values[0]
        damping = 2.0 * CONTACT_DAMPING_RATIO * sqrt(CONTACT_STIFFNESS * MOTOR_INERTIA)
        if twist > half:
            return max(0.0, CONTACT_STIFFNESS * (twist - half) + damping * twist_rate)
        if twist < -half:
            return min(0.0, CONTACT_STIFFNESS * (twist + half) + damping * twist_rate)
        return 0.0

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion of the link, which swings over smoothly where the transmitted torque changes sign."""
        j = motion.joint_index(self.joint)
        load, rate, curvature = (torque[:, j] / CROSSING_TORQUE for torque in motion.transmitted)
        side = np.tanh(load)
        slope = 1.0 - side**2
        half = 0.5 * shape[0]
        q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
        q[:, j] -= half * side
        dq[:, j] -= half * slope * rate
        ddq[:, j] -= half * slope * (curvature - 2.0 * side * rate**2)
        return motion.with_state(q, dq, ddq)
