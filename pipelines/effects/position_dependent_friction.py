"""Dry friction that depends on the joint's position."""

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class PositionDependentFriction(Effect):
    """A Coulomb level that changes with position, due to misaligned bearings or a worn gear.

    In the middle of the swept positions the level is the baseline's Coulomb friction. Beyond their
    ends it stays the same, as a polynomial would soon become absurd there.
    """

    name = "position_dependent_friction"
    title = "Position-dependent friction"
    side = Side.DRIVE
    family = Family.ANGLE
    limits_travel = True
    any_form = "friction_by_angle"
    resembles = ("friction_by_angle", "angle", "speed")
    forms_differ = "a real level may have a peak at one angle, and change the viscous friction too"
    holds = True
    equation = (
        "tau = (c1 d + c2 d² + c3 (d / h)³ + c4 (d / h)⁴) sgn(v), d = q limited to q1 ... q2, less"
        " their mean; h = (q2 - q1) / 2. Without ends d = q and h = 1"
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
        Parameter("cubic", "N·m", "third-order part of it at q2", "c3", (-2.0, 2.0), default=0.0),
        Parameter(
            "quartic", "N·m", "fourth-order part of it at q2", "c4", (-2.0, 2.0), default=0.0
        ),
    )
    shape = (
        Parameter(
            "lowest_angle",
            "rad",
            "angle below which the level stays the same; equal to q2 for none",
            "q1",
            (-1.6, 0.0),
            default=0.0,
            swept_end=-1,
        ),
        Parameter(
            "highest_angle",
            "rad",
            "angle above which the level stays the same",
            "q2",
            (0.0, 1.6),
            default=0.0,
            swept_end=1,
        ),
    )
    parity = Parity.ODD

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add the level times sgn v at the joint."""
        low, high = values[4], values[5]
        d, x = at.q[joint], at.q[joint]
        if low < high:
            d = min(max(d, low), high) - 0.5 * (low + high)
            x = 2.0 * d / (high - low)
        level = (values[0] + values[1] * d) * d + (values[2] + values[3] * x) * x**3
        out[joint] += level * at.direction[joint]
