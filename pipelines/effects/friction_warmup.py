"""Friction that falls while the gear warms."""

from math import exp

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class FrictionWarmup(Effect):
    """Viscous and Coulomb friction above their warm level, decaying from the run's start."""

    name = "friction_warmup"
    title = "Friction warm-up"
    side = Side.DRIVE
    family = Family.TIME
    resembles = ("friction_over_time", "speed")
    forms_differ = "a real gear warms with its losses, and in more than one time constant"
    equation = "tau = (dv v + ds sgn(v)) exp(-t / T)"
    source = (
        "Simoni, Beschi, Legnani, Visioli (2015), IROS: friction with temperature effects in"
        " industrial robots"
    )
    looks_like = "residual in step with speed that shrinks from period to period"
    confirm = "repeat one motion from cold for ten minutes and watch torque and motor temperature"
    linear = (
        Parameter(
            "viscous_drop", "N·m·s/rad", "viscous friction lost while warming", "dv", (0.3, 6.0)
        ),
        Parameter("coulomb_drop", "N·m", "Coulomb friction lost while warming", "ds", (0.0, 4.0)),
    )
    shape = (
        Parameter("time_constant", "s", "time in which the excess falls to 1/e", "T", (8.0, 120.0)),
    )
    parity = Parity.ODD
    dissipative = True

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add (dv v + ds sgn v) exp(-t/T) at the joint."""
        level = values[0] * at.dq[joint] + values[1] * at.direction[joint]
        out[joint] += level * exp(-at.t / values[2])
