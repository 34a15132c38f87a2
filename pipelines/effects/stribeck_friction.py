"""Stribeck friction: more torque at creeping speed than at higher speed."""

from math import exp

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class StribeckFriction(Effect):
    """Friction that falls as the lubricant film builds up."""

    name = "stribeck_friction"
    title = "Stribeck friction"
    side = Side.DRIVE
    family = Family.SPEED
    resembles = ("speed",)
    forms_differ = "a real fall may have another exponent, and return a moment late"
    holds = True
    equation = "tau = F exp(-abs(v / vs)^d) sgn(v), d = 2 by default"
    source = (
        "Stribeck (1902); Armstrong-Hélouvry, Dupont, Canudas de Wit (1994), Automatica 30(7),"
        " eq. 3"
    )
    looks_like = "a narrow peak of friction on both sides of zero speed"
    confirm = (
        "creep the empty joint at several speeds up to a tenth of its fastest and plot torque"
        " against speed"
    )
    linear = (
        Parameter(
            "stribeck_torque",
            "N·m",
            "friction above the Coulomb level at standstill",
            "F",
            (0.3, 6.0),
        ),
    )
    shape = (
        Parameter(
            "stribeck_velocity",
            "rad/s",
            "speed at which the excess has fallen to 1/e",
            "vs",
            (0.03, 0.8),
        ),
        Parameter(
            "exponent", "1", "form of the fall", "d", (0.5, 2.0), default=2.0, forms=(2.0, 1.0, 0.5)
        ),
    )
    parity = Parity.ODD
    dissipative = True

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add F exp(-abs(v/vs)^d) sgn v at the joint."""
        ratio = abs(at.dq[joint] / values[1])
        out[joint] += values[0] * exp(-(ratio ** values[2])) * at.direction[joint]
