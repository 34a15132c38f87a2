"""A segment whose centre of mass lies off its axis."""

from typing import ClassVar

from pipelines.effects.effect import Effect, Element, Family, Parameter, Parity, Side, Tie
from pipelines.mechanics.mechanisms.leg import LEG


class MassOffAxis(Effect):
    """A foot, a motor housing: a first moment of mass across the segment.

    A mass across the axis equals one along it, turned forward by a right angle. With Y the moment
    across, kinetic and potential energy have Y in place of X3 (shank) or X4 (thigh), and the
    segment's absolute angle plus pi/2 in place of that angle. Its moment of inertia is part of X1
    and X2.
    """

    name = "mass_off_axis"
    title = "Mass off the axis"
    side = Side.STRUCTURE
    family = Family.ANGLE
    resembles = ("angle", "other_angle", "both_angles")
    forms_differ = "a real part may also move on its segment, as a cable does"
    equation = (
        "tau = Y3 dA3 (shank) or Y4 dA4 (thigh): columns X3, X4 with the segment a right angle"
        " ahead"
    )
    source = (
        "Khalil, Dombre (2002), Modeling, Identification and Control of Robots, ch. 9 (first"
        " moments MX, MY)"
    )
    looks_like = "gravity torque like the cosine of the link's angle: largest where the link hangs"
    confirm = "let the joint hang freely: it rests off the vertical, towards the mass"
    mechanism_equation = "mass_across"
    may_be_worn = True
    element = Element.MASS_ACROSS
    ties: ClassVar = {
        "encoder_offset": Tie(
            "under one load a shifted zero and a mass off the axis turn gravity alike",
            "record with another load as well, a person or a known weight: an offset is one angle"
            " in both, a mass is not",
        ),
        "base_tilt": Tie(
            "under one load a tilted base and a mass off the axis turn gravity alike",
            "record with another load as well, a person or a known weight, or put a spirit level on"
            " the base",
        ),
    }
    by_angle = True
    linear = (
        Parameter(
            "mass_moment", "kg·m", "mass times distance forward of the axis", "Y", (-0.6, 0.6)
        ),
    )
    # A mass across the shank changes the coupling of both links, and so the mass matrix.
    inertial = True
    parity = Parity.EVEN
    # The leg's equation. For other machines, the base class replaces it.
    reaction = staticmethod(LEG.reactions[mechanism_equation])
