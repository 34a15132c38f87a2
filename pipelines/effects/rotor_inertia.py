"""The rotor behind the gear: an inertia that reacts to its own joint's acceleration only."""

from typing import ClassVar

from pipelines.effects.effect import Effect, Element, Family, Parameter, Parity, Side
from pipelines.effects.kernel import reaction


class RotorInertia(Effect):
    """The motor's inertia times the gear ratio squared."""

    name = "rotor_inertia"
    title = "Rotor inertia"
    side = Side.DRIVE
    family = Family.TRANSMISSION
    resembles = ("inertia_by_angle",)
    forms_differ = "a real rotor sits behind a gear that twists"
    equation = "tau = J ddq, at its own joint only"
    source = (
        "Sciavicco, Siciliano, Villani (1996), Advanced Robotics 10(3): motor inertia in"
        " gear-driven manipulators"
    )
    looks_like = (
        "residual in step with its joint's own acceleration; X2 too large for a link of that weight"
    )
    confirm = (
        "look up the rotor's inertia and the gear ratio: J is the inertia times the ratio squared"
    )
    # On a single joint, the rotor's inertia is part of X1.
    absorbed_as = "inertia"
    element = Element.ARMATURE
    joints = ("knee",)
    # Its column at the hip, ddq1 in the hip's row, is that of X1.
    absorbed: ClassVar = {"hip": "X1"}
    linear = (
        Parameter("inertia", "kg·m²", "rotor inertia reflected to the joint", "J", (0.03, 1.0)),
    )
    inertial = True
    parity = Parity.EVEN

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add J ddq at the joint."""
        out[joint] += values[0] * at.ddq[joint]
