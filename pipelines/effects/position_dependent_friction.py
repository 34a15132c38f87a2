"""Dry friction that depends on the joint's position."""

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class PositionDependentFriction(Effect):
    """A Coulomb level that changes with position, due to misaligned bearings or a worn gear.

    The level at angle zero is the baseline's Coulomb friction.
    """

    name = "position_dependent_friction"
    title = "Position-dependent friction"
    side = Side.DRIVE
    family = Family.ANGLE
    any_form = "friction_by_angle"
    resembles = ("friction_by_angle", "angle", "speed")
    forms_differ = "a real level may have a peak at one angle, and change the viscous friction too"
    holds = True
    equation = "tau = (c1 q + c2 q²) sgn(v)"
    source = "Armstrong (1988), ICRA: friction, experimental determination, modeling, compensation"
    looks_like = "residual against angle: two branches, forward and back, whose distance changes"
    confirm = (
        "move the empty joint slowly both ways through its range, "
        "and plot half the difference of the torques against position"
    )
    linear = (
        Parameter("slope", "N·m/rad", "growth of the Coulomb level with angle", "c1", (-4.0, 4.0)),
        Parameter("curvature", "N·m/rad²", "growth of the slope with angle", "c2", (-6.0, 6.0)),
    )
    parity = Parity.ODD

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add (c1 q + c2 q²) sgn v at the joint."""
        q = at.q[joint]
        out[joint] += (values[0] + values[1] * q) * q * at.direction[joint]
