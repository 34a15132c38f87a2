"""Drag that grows with the square of speed."""

from pipelines.effects.effect import Effect, Element, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class QuadraticDrag(Effect):
    """Churning of lubricant, or windage."""

    name = "quadratic_drag"
    title = "Quadratic drag"
    side = Side.DRIVE
    family = Family.SPEED
    resembles = ("speed",)
    forms_differ = "real drag has another power of the speed, and none below some speed"
    equation = "tau = c v abs(v)"
    source = (
        "Olsson, Åström, Canudas de Wit, Gäfvert, Lischinsky (1998), European J. Control 4(3), eq."
        " 4, exponent 2"
    )
    looks_like = "friction against speed: curved upward at the fast end on both sides"
    confirm = (
        "move the empty joint at constant speeds up to the fastest and plot torque against speed"
    )
    element = Element.QUADRATIC_DAMPING
    linear = (Parameter("drag", "N·m·s²/rad²", "torque per speed squared", "c", (0.3, 6.0)),)
    parity = Parity.ODD
    dissipative = True

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add c v abs(v) at the joint."""
        v = at.dq[joint]
        out[joint] += values[0] * v * abs(v)
