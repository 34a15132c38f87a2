"""The two rigid links of leg and exoskeleton together."""

from pipelines.effects.effect import Effect, Parameter, Parity, Side
from pipelines.effects.kernel import reaction
from pipelines.mechanics.leg import regressor_at


class RigidBody(Effect):
    """Inertia, Coriolis, centrifugal and gravity torque of the leg."""

    name = "rigid_body"
    title = "Rigid body"
    side = Side.STRUCTURE
    equation = "tau = M(q) ddq + C(q, dq) dq + G(q) = A(q, dq, ddq) (X1, X2, X3, X4)"
    source = "Lagrange's equations of a planar double pendulum, docs/errata.md"
    looks_like = "what every fit starts with: torque in step with acceleration and with gravity"
    confirm = "weigh the segments, or hold the leg still at several angles and read the torque"
    whole_leg = True
    inertial = True
    parity = Parity.EVEN
    linear = (
        Parameter("X1", "kg·m²", "inertia about the hip with the knee at a right angle", "X1", (1.0, 12.0)),
        Parameter("X2", "kg·m²", "inertia of the shank about the knee", "X2", (0.2, 4.0)),
        Parameter("X3", "kg·m", "first moment of the shank about the knee", "X3", (0.5, 3.0)),
        Parameter("X4", "kg·m", "first moment of the thigh, shank's mass at the knee, about the hip", "X4", (1.0, 8.0)),
    )

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add A(q, dq, ddq) X."""
        hip, knee = regressor_at(at.q, at.dq, at.ddq, geometry[0], geometry[1])
        for i in range(4):
            out[0] += hip[i] * values[i]
            out[1] += knee[i] * values[i]
