"""A limb that moves against its cuff."""

from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Parameter, Side
from pipelines.effects.kernel import spring
from pipelines.mechanics.motion import Motion

RELAXATION_S = 0.005
"""Damping over stiffness of soft tissue under a strap."""

MACHINE_INERTIA = 0.02
"""kg·m² on the machine's side, so that the joint has some where a model counts all of its mass as the limb's."""


class CuffCompliance(Effect):
    """Soft tissue and straps: the limb lags the exoskeleton by the torque between them over a stiffness.

    What sits on the wearer's side of the cuffs, and only that, sees the limb's motion: human effects, and the
    rigid body bound to ``with_human`` runs. Where that body counts machine and human together, as a fit of each
    kind of run for itself has it, the stiffness comes out too high by the machine's share of the mass; with the
    machine's body of its own beside the human's it is exact.
    """

    name = "cuff_compliance"
    title = "Cuff compliance"
    side = Side.HUMAN
    equation = "limb angle = exoskeleton angle - torque on the limb / k"
    source = "Yandell, Quinlivan, Popov, Walsh, Zelik (2017), J. NeuroEngineering and Rehabilitation 14:40"
    looks_like = "with the human only, gravity and inertia torques off in step with the cuff forces"
    confirm = "clamp the exoskeleton, push the limb with a force gauge, and measure how far it moves"
    acts_in = ("with_human",)
    shape = (Parameter("stiffness", "N·m/rad", "torque between machine and limb per angle", "k", (80.0, 3000.0)),)
    at_cuff = True
    motor_inertia = MACHINE_INERTIA

    @spring
    def spring(twist, twist_rate, values):
        """Return k (twist + relaxation twist_rate)."""
        return values[0] * (twist + RELAXATION_S * twist_rate)

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion of the limb."""
        j = self.column(motion)
        q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
        for state, torque in zip((q, dq, ddq), motion.on_limb, strict=True):
            state[:, j] -= torque[:, j] / shape[0]
        return motion.with_state(q, dq, ddq)
