"""Dry friction that depends on the joint's position."""

from math import pi

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class PositionDependentFriction(Effect):
    """A Coulomb level that changes with position, due to misaligned bearings or a worn gear.

    The baseline's Coulomb friction is added to it. Beyond the positions of the runs from which it
    was fitted the level does not change, as a polynomial would soon become absurd there.
    """

    name = "position_dependent_friction"
    title = "Position-dependent friction"
    side = Side.DRIVE
    family = Family.ANGLE
    any_form = "friction_by_angle"
    resembles = ("friction_by_angle", "angle", "speed")
    forms_differ = "a real level may have a peak at one angle, and change the viscous friction too"
    holds = True
    equation = (
        "tau = (c1 d + c2 d² + c3 P3(d / h) + c4 P4(d / h)) sgn(v), d = q - (q1 + q2) / 2 with q"
        " limited to q1 ... q2, h = (q2 - q1) / 2, P Legendre polynomials"
    )
    source = "Armstrong (1988), ICRA: friction, experimental determination, modeling, compensation"
    looks_like = "residual against angle: two branches, forward and back, whose distance changes"
    confirm = (
        "move the empty joint slowly both ways through its range, "
        "and plot half the difference of the torques against position"
    )
    linear = (
        Parameter("slope", "N·m/rad", "growth of the Coulomb level with angle", "c1", (-4.0, 4.0)),
        Parameter("curvature", "N·m/rad²", "growth of the slope with angle", "c2", (-6.0, 6.0)),
        Parameter("cubic", "N·m", "size of the third polynomial", "c3", (-2.0, 2.0), default=0.0),
        Parameter(
            "quartic", "N·m", "size of the fourth polynomial", "c4", (-2.0, 2.0), default=0.0
        ),
    )
    shape = (
        Parameter(
            "lowest_angle",
            "rad",
            "angle below which the level stays the same",
            "q1",
            (-1.6, 0.0),
            default=-pi,
            swept_end=-1,
        ),
        Parameter(
            "highest_angle",
            "rad",
            "angle above which the level stays the same",
            "q2",
            (0.0, 1.6),
            default=pi,
            swept_end=1,
        ),
    )
    parity = Parity.ODD

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add the level times sgn v at the joint."""
        low, high = values[4], values[5]
        d = min(max(at.q[joint], low), high) - 0.5 * (low + high)
        x = 2.0 * d / (high - low)
        cubic, quartic = 0.5 * (5.0 * x**2 - 3.0) * x, 0.125 * ((35.0 * x**2 - 30.0) * x**2 + 3.0)
        level = (values[0] + values[1] * d) * d + values[2] * cubic + values[3] * quartic
        out[joint] += level * at.direction[joint]
