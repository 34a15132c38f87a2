"""A limb that moves against its cuff."""

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side
from pipelines.effects.kernel import spring
from pipelines.effects.swing import behind_spring
from pipelines.mechanics.motion import Motion


class CuffCompliance(Effect):
    """Soft tissue and straps: the limb lags the exoskeleton by torque over stiffness.

    Only effects on the wearer's side of the cuffs see the limb's motion: human effects, and the
    rigid body bound to ``with_human`` runs. If that body holds machine and human together, as in a
    fit of each kind of run by itself, the stiffness is overestimated by the machine's share of the
    mass. With a separate body of the machine it is exact.

    Forward dynamics supports only a shank that moves with the thigh; ``shank_held`` is for measured
    motions.
    """

    name = "cuff_compliance"
    title = "Cuff compliance"
    side = Side.HUMAN
    family = Family.PERSON
    resembles = ("angle", "load", "speed", "inertia_by_angle", "other_load", "both_angles")
    forms_differ = "real tissue hardens, creeps, and slides in its cuff"
    equation = "torque on the limb = k twist (1 + h twist²); limb angle = exoskeleton angle - twist"
    source = (
        "Yandell, Quinlivan, Popov, Walsh, Zelik (2017), J. NeuroEngineering and Rehabilitation"
        " 14:40"
    )
    looks_like = "with the human only, gravity and inertia torques off in step with the cuff forces"
    confirm = (
        "clamp the exoskeleton, push the limb with a force gauge, and measure how far it moves"
    )
    acts_in = ("with_human",)
    shape = (
        Parameter(
            "stiffness",
            "N·m/rad",
            "torque between machine and limb per small angle",
            "k",
            (30.0, 2000.0),
        ),
        Parameter(
            "shank_held",
            "1",
            "1 if the shank's own cuff holds it while the thigh moves",
            "e",
            (0.0, 1.0),
            default=0.0,
            forms=(1.0, 0.0),
            between_forms=False,
        ),
        Parameter(
            "hardening",
            "1/rad²",
            "growth of the stiffness with the angle's square",
            "h",
            (0.0, 200.0),
            default=0.0,
            forms=(0.0, 60.0),
        ),
    )
    at_cuff = True
    # Of the machine's side: a joint needs some even if a model assigns all mass to the limb.
    motor_inertia = 0.02
    known_to = 0.05
    swings = True

    @spring
    def spring(twist, twist_rate, values):
        """Return k (twist (1 + h twist²) + relaxation twist_rate)."""
        # Damping over stiffness of soft tissue under a strap, s.
        relaxation_s = 0.02
        return values[0] * (twist * (1.0 + values[2] * twist * twist) + relaxation_s * twist_rate)

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion of the limb; without its mass, it follows its torque immediately.

        Parameters
        ----------
        motion : Motion
            Of the links, n samples.
        shape : array or tuple of float
            Stiffness, N·m/rad; then, unless missing, whether the knee is held, and hardening,
            1/rad².

        Returns
        -------
        Motion
            Of the limb, n samples.
        """
        stiffness, held, hardening = self.completed(shape)
        direction = self._direction(motion, held > 0.0)
        if motion.limb_body is not None:
            values = (stiffness, held, hardening)
            return behind_spring(motion, motion.limb_body, direction, self, values)
        # Torque along the twist over stiffness; hardening and the limb's mass are neglected.
        q, dq, ddq = (
            state - direction * np.sum(direction * torque, axis=1, keepdims=True) / stiffness
            for state, torque in zip((motion.q, motion.dq, motion.ddq), motion.on_limb, strict=True)
        )
        return motion.with_state(q, dq, ddq)

    def _direction(self, motion: Motion, shank_held: bool) -> NDArray:
        """Return the rotation of the limb's joints per unit of twist, (n, J).

        A thigh that moves in its cuff moves the knee. The shank moves with it, or pivots in a cuff
        that is firm.
        """
        j = self.column(motion)
        direction = np.zeros_like(motion.q)
        direction[:, j] = 1.0
        below = motion.geometry.shank_cuff_distance_m
        # The shank's cuff keeps its place across the shank: L1 cos q2 + d_s (1 + dq2) = 0.
        if shank_held and j == 0 and below is not None:
            direction[:, 1] = -1.0 - motion.geometry.thigh_length_m * np.cos(motion.q[:, 1]) / below
        return direction
