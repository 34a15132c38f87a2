"""A segment whose centre of mass lies beside its axis."""

from math import cos, sin

from pipelines.effects.effect import Effect, Parameter, Parity, Side
from pipelines.effects.kernel import reaction
from pipelines.mechanics.leg import regressor_rows


class MassOffAxis(Effect):
    """A foot, a motor housing: a first moment of mass across the segment.

    A mass across the axis is one along it, turned forward by a right angle: with Y the moment across,
    kinetic and potential energy have Y where they have X3 (shank) or X4 (thigh), and the segment's
    absolute angle plus pi/2 where they have that angle. Its moment of inertia is in X1 and X2.
    """

    name = "mass_off_axis"
    title = "Mass off the axis"
    side = Side.STRUCTURE
    equation = "tau = Y3 dA3 (shank) or Y4 dA4 (thigh): columns X3, X4 with the segment a right angle ahead"
    source = "Khalil, Dombre (2002), Modeling, Identification and Control of Robots, ch. 9 (first moments MX, MY)"
    looks_like = "gravity torque like the cosine of the segment's angle: largest where the segment hangs"
    confirm = "let the joint hang freely: it rests off the vertical, towards the mass"
    linear = (Parameter("mass_moment", "kg·m", "mass times distance forward of the axis", "Y", (-0.6, 0.6)),)
    inertial = True
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add the column of X4 (hip) or X3 (knee) a right angle ahead."""
        q, leg = at.q, at.q[0] + at.q[1]
        # sin and cos of an angle a right angle ahead are the cos and -sin of the angle.
        hip, knee = regressor_rows(cos(q[0]), cos(leg), cos(q[1]), -sin(q[1]), at.dq, at.ddq, geometry[0], geometry[1])
        column = 3 - joint
        out[0] += values[0] * hip[column]
        out[1] += values[0] * knee[column]
