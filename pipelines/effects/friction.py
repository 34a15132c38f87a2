"""Coulomb and viscous friction of a drive: the baseline of every other drive effect."""

from pipelines.effects.effect import Effect, Element, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class Friction(Effect):
    """A constant torque against the motion, and one proportional to speed."""

    name = "friction"
    title = "Coulomb and viscous friction"
    side = Side.DRIVE
    family = Family.SPEED
    resembles = ("speed",)
    forms_differ = "real friction has no sharp corner at standstill and no straight line above it"
    equation = "tau = Ks sgn(v) + Km v"
    source = (
        "paper, appendix A (tau_fic); Armstrong-Hélouvry, Dupont, Canudas de Wit (1994), Automatica"
        " 30(7)"
    )
    looks_like = (
        "a square wave that flips with the direction of motion, on a ramp in proportion to speed"
    )
    confirm = (
        "move the empty joint at several constant speeds both ways and plot torque against speed"
    )
    element = Element.FRICTION
    linear = (
        Parameter("coulomb", "N·m", "friction torque once the joint moves", "Ks", (0.5, 8.0)),
        Parameter("viscous", "N·m·s/rad", "friction torque per unit of speed", "Km", (0.5, 10.0)),
    )
    parity = Parity.ODD
    dissipative = True

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add Ks sgn(v) + Km v at the joint."""
        out[joint] += values[0] * at.direction[joint] + values[1] * at.dq[joint]
