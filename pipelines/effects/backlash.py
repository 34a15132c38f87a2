"""Play between motor and link."""

from math import sqrt
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side, Tie
from pipelines.effects.joint_elasticity import MOTOR_INERTIA
from pipelines.effects.kernel import spring
from pipelines.effects.swing import link_behind_motor
from pipelines.mechanics.motion import Motion

CONTACT_STIFFNESS = 30000.0
"""Stiffness of hard teeth in contact, N·m/rad; much above that of any joint, but low enough for the
integration step."""

SHAFT_STIFFNESS = 4000.0
"""Stiffness of teeth on a shaft that twists, N·m/rad. Only at this stiffness does a measured motion
determine the link's impacts."""


class Backlash(Effect):
    """The transmitted torque pushes the link to one side of the play."""

    name = "backlash"
    title = "Backlash"
    side = Side.DRIVE
    family = Family.TRANSMISSION
    needs_torque = True
    resembles = ("load", "angle", "speed", "inertia_by_angle")
    forms_differ = "real play differs from tooth to tooth, and the link bounces in it"
    equation = "load angle = motor angle - play / 2 * sgn(transmitted torque)"
    source = (
        "Nordin, Gutman (2002), Automatica 38(10): controlling mechanical systems with backlash,"
        " sec. 2"
    )
    looks_like = (
        "bursts of torque at 4 to 25 Hz wherever the load changes sign, and gravity that jumps"
        " there"
    )
    confirm = "hold the motor and shake the link by hand: it moves freely by the play"
    reversal_travel = "play between encoder and friction"
    ties: ClassVar = {
        "encoder_offset": Tie(
            "while the load pushes to one side only, play shifts the angle by a constant half of"
            " it",
            "move the joint through angles where the load changes sign, or shake the link by hand",
        ),
    }
    by_angle = True
    shape = (
        Parameter("play", "rad", "free travel from stop to stop", "p", (0.003, 0.06)),
        Parameter(
            "contact_stiffness",
            "N·m/rad",
            "stiffness of the teeth in contact",
            "k",
            (1000.0, 100000.0),
            default=CONTACT_STIFFNESS,
            forms=(CONTACT_STIFFNESS, SHAFT_STIFFNESS),
        ),
    )
    motor_inertia = MOTOR_INERTIA
    exoskeleton_only = True
    known_to = 0.2
    swings = True

    @spring
    def spring(twist, twist_rate, values):
        """Return zero within the play; beyond it, the torque of teeth that push and never pull."""
        # Damping ratio of the motor's swing on its teeth.
        contact_damping_ratio = 0.3
        half = 0.5 * values[0]
        damping = 2.0 * contact_damping_ratio * sqrt(values[1] * MOTOR_INERTIA)
        if twist > half:
            return max(0.0, values[1] * (twist - half) + damping * twist_rate)
        if twist < -half:
            return min(0.0, values[1] * (twist + half) + damping * twist_rate)
        return 0.0

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion of the link, which crosses the play and strikes the teeth.

        If the teeth are hard, or the link's mass is unknown, the link lies on the side towards
        which the transmitted torque pushes it, at the motor's speed: after an impact of hard teeth,
        a motor jumps faster than it is sampled.

        Parameters
        ----------
        motion : Motion
            Of the motors, n samples.
        shape : array or tuple of float
            Play, rad, and stiffness, N·m/rad; the latter may be missing.

        Returns
        -------
        Motion
            Of the links, n samples.
        """
        values = self.completed(shape)
        if motion.body is not None and values[1] < max(self.shape[1].forms):
            # A measured motion does not determine how the link bounces, so impacts are critically
            # damped.
            return link_behind_motor(motion, motion.body, self, values, 1.0)
        # A smooth sign: below 2 N·m, noise would throw the link from side to side.
        j, q = self.column(motion), motion.q.copy()
        side = np.tanh(motion.transmitted[0][:, j] / (2.0 * self.scale.torque))
        q[:, j] -= 0.5 * shape[0] * side
        return motion.with_state(q, motion.dq, motion.ddq)
