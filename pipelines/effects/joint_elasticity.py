"""A joint that twists: the encoder is on the motor's side, the link behind a spring."""

from math import sqrt

from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Element, Family, Parameter, Side
from pipelines.effects.kernel import spring
from pipelines.effects.swing import link_behind_motor
from pipelines.mechanics.motion import Motion

MOTOR_INERTIA = 0.1
"""Inertia that stays with the motor, kg·m² at the joint; a small part of a rigid drive's."""

DAMPING_RATIO = 0.1
"""Damping ratio of the motor's swing on the spring, as of a harmonic drive's flexspline."""


class JointElasticity(Effect):
    """A torsion spring between motor and link, the encoder on the motor."""

    name = "joint_elasticity"
    title = "Joint elasticity"
    side = Side.DRIVE
    family = Family.TRANSMISSION
    needs_torque = True
    resembles = ("load", "angle", "speed", "inertia_by_angle", "other_load")
    forms_differ = "a real gear hardens with its twist, and loses energy in a loop"
    equation = "torque = k twist (1 + h twist²); load angle = motor angle - twist"
    source = (
        "Spong (1987), ASME J. Dyn. Sys. Meas. Control 109(4), eq. 8; Tuttle, Seering (1996), IEEE"
        " T-RA 12(3)"
    )
    looks_like = "gravity and inertia torques too small or too large in step with the load itself"
    confirm = "clamp the link, raise the motor's torque slowly and read the encoder"
    reversal_travel = "play between encoder and friction"
    element = Element.SERIES_SPRING
    shape = (
        Parameter("stiffness", "N·m/rad", "torque per angle of small twist", "k", (60.0, 8000.0)),
        Parameter(
            "hardening",
            "1/rad²",
            "growth of the stiffness with the twist's square",
            "h",
            (0.0, 1000.0),
            default=0.0,
            forms=(0.0, 100.0, 600.0),
        ),
    )
    motor_inertia = MOTOR_INERTIA
    damping_ratio = DAMPING_RATIO
    known_to = 0.08
    swings = True

    @spring
    def spring(twist, twist_rate, values):
        """Return k twist (1 + h twist²) + d twist_rate, d from the damping ratio."""
        damping = 2.0 * DAMPING_RATIO * sqrt(values[0] * MOTOR_INERTIA)
        return values[0] * twist * (1.0 + values[1] * twist * twist) + damping * twist_rate

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion of the link behind the spring.

        Without its mass, the link follows its torque immediately.

        Parameters
        ----------
        motion : Motion
            Of the motors, n samples.
        shape : array or tuple of float
            Stiffness, N·m/rad; then, unless missing, hardening, 1/rad².

        Returns
        -------
        Motion
            Of the links, n samples.
        """
        # Damping ratio of the link's swing behind a measured motion. A larger one damps the true
        # swing, a smaller one lets errors persist.
        swing_ratio = 0.05
        if motion.body is not None:
            return link_behind_motor(motion, motion.body, self, self.completed(shape), swing_ratio)
        # Torque over stiffness; hardening and the link's mass are neglected.
        j = self.column(motion)
        q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
        for state, load_rate in zip((q, dq, ddq), motion.transmitted, strict=True):
            state[:, j] -= load_rate[:, j] / shape[0]
        return motion.with_state(q, dq, ddq)
