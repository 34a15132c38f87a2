"""Viscous friction that differs with direction."""

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class ViscousAsymmetry(Effect):
    """More viscous friction in one direction than in the other."""

    name = "viscous_asymmetry"
    title = "Viscous asymmetry"
    side = Side.DRIVE
    family = Family.SPEED
    resembles = ("speed",)
    forms_differ = "a real slope is not straight in either direction"
    equation = "tau = c abs(v): Km + c forward, Km - c backward"
    source = "Armstrong-Hélouvry (1991), Control of Machines with Friction, Kluwer, ch. 4"
    looks_like = "torque against speed: a V, zero at standstill"
    confirm = "move the empty joint at several constant speeds both ways and compare the two slopes"
    linear = (
        Parameter(
            "asymmetry",
            "N·m·s/rad",
            "half of forward less backward viscous friction",
            "c",
            (-4.0, 4.0),
        ),
    )
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add c abs(v) at the joint."""
        out[joint] += values[0] * abs(at.dq[joint])
