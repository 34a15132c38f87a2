"""Presliding: after a reversal friction builds up over a small travel, like a spring that yields."""

from pipelines.effects.effect import Effect, Parameter, Side
from pipelines.effects.kernel import derivative, reaction


class PreslidingHysteresis(Effect):
    """Dahl's friction, its memory z the share of the torque already built up, in [-1, 1]."""

    name = "presliding_hysteresis"
    title = "Presliding hysteresis"
    side = Side.DRIVE
    equation = "tau = F z, dz/dt = (v - abs(v) z) / travel"
    source = "Dahl (1976), AIAA Journal 14(12), eq. 4 with exponent 1"
    looks_like = "friction against angle: a loop whose corners are rounded after each reversal"
    confirm = "move the empty joint to and fro by a few hundredths of a radian and plot torque against angle"
    linear = (Parameter("friction_torque", "N·m", "friction torque once sliding", "F", (0.5, 8.0)),)
    shape = (
        Parameter("presliding_angle", "rad", "travel over which friction builds up to 63 %", "travel", (0.003, 0.15)),
    )
    states = 1

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add F z at the joint."""
        out[joint] += values[0] * state[0]

    @derivative
    def derivative(at, state, values, geometry, joint, out):
        """Write dz/dt = (v - abs(v) z) / travel."""
        v = at.dq[joint]
        out[0] = (v - abs(v) * state[0]) / values[1]
