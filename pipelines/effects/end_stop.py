"""A stop that the joint touches within its range."""

from pipelines.effects.effect import Effect, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class EndStop(Effect):
    """A bumper, a strap or a cover that is pressed beyond an angle, on one side.

    The stiffness is torque per angle at a depth of 0.1 rad (0.1 m at a prismatic joint), so that
    its unit is the same for every exponent. A flat bumper has the exponent 1, two spheres 1.5.
    """

    name = "end_stop"
    title = "End stop"
    side = Side.STRUCTURE
    family = Family.ANGLE
    limits_travel = True
    resembles = ("angle", "both_angles")
    forms_differ = "a real stop has damping, and may engage a second part at a greater depth"
    equation = "tau = s k w (s (q - q0) / w)^p where s (q - q0) > 0, else 0; w = 0.1 rad"
    source = "Hunt, Crossley (1975), ASME J. Applied Mechanics 42(2), eq. 7: contact force k x^p"
    looks_like = "residual against angle: zero up to a kink, then steep, the same both ways"
    confirm = "switch the drive off, move the joint slowly by hand, and note where it first resists"
    linear = (
        Parameter(
            "stiffness",
            "N·m/rad",
            "torque per angle at a depth of 0.1 rad (0.1 m)",
            "k",
            (5.0, 200.0),
        ),
    )
    shape = (
        Parameter(
            "contact_angle",
            "rad",
            "angle at which it is touched",
            "q0",
            (-1.6, 0.9),
            swept=True,
        ),
        Parameter(
            "direction",
            "1",
            "direction that it stops: 1 forward, -1 backward",
            "s",
            (-1.0, 1.0),
            default=1.0,
            forms=(1.0, -1.0),
            between_forms=False,
        ),
        Parameter(
            "exponent",
            "1",
            "power of the depth",
            "p",
            (1.0, 2.0),
            default=1.5,
            forms=(1.0, 1.5, 2.0),
        ),
    )
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add s k w (depth / w)^p beyond the contact."""
        way = 1.0 if values[2] >= 0.0 else -1.0
        # A depth is positive in the direction that the stop blocks.
        depth = way * (at.q[joint] - values[1])
        if depth > 0.0:
            # Depth at which `stiffness` is stated, rad (m at a prismatic joint).
            stated_at = 0.1
            out[joint] += way * values[0] * stated_at * (depth / stated_at) ** values[3]
