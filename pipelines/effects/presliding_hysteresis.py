"""Presliding: after a reversal, friction builds up over a small travel, like a yielding spring."""

from pipelines.effects.effect import Effect, Family, Parameter, Side
from pipelines.effects.kernel import derivative, reaction


class PreslidingHysteresis(Effect):
    """Dahl's friction; its memory z in [-1, 1] is the share of the torque already built up."""

    name = "presliding_hysteresis"
    title = "Presliding hysteresis"
    side = Side.DRIVE
    family = Family.REVERSAL
    resembles = ("speed", "friction_by_angle")
    forms_differ = "a real loop depends on where the joint turned before, and how long it stood"
    holds = True
    equation = "tau = F z, dz/dt = v / travel * (1 - z sgn(v))^i, i = 1 by default"
    source = "Dahl (1976), AIAA Journal 14(12), eq. 4"
    looks_like = "friction against angle: a loop whose corners are rounded after each reversal"
    confirm = (
        "move the empty joint to and fro by a few hundredths of its travel and plot torque against"
        " position"
    )
    reversal_travel = "friction that builds up before the surfaces slide"
    linear = (Parameter("friction_torque", "N·m", "friction torque once sliding", "F", (0.5, 8.0)),)
    shape = (
        Parameter(
            "presliding_angle",
            "rad",
            "travel over which friction builds up to 63 %",
            "travel",
            (0.003, 0.15),
        ),
        Parameter(
            "exponent",
            "1",
            "form of the build-up",
            "i",
            (0.5, 2.0),
            default=1.0,
            forms=(1.0, 2.0, 0.5),
        ),
    )
    states = 1

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add F z at the joint."""
        out[joint] += values[0] * state[0]

    @derivative
    def derivative(at, state, values, geometry, joint, out):
        """Write dz/dt = v / travel (1 - z sgn v)^i."""
        v, z = at.dq[joint], state[0]
        # A step may carry z beyond 1, and the power of a negative number is not real.
        remaining = max(0.0, 1.0 - z) if v > 0.0 else max(0.0, 1.0 + z)
        # A power costs ten times as much as the rest.
        out[0] = v / values[1] * (remaining if values[2] == 1.0 else remaining ** values[2])
