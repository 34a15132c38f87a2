"""A spring in parallel with the drive."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Element, Family, Parameter, Parity, Side, Tie
from pipelines.effects.kernel import reaction
from pipelines.effects.torque_offset import TorqueOffset
from pipelines.mechanics.machine import THE_LEG


class ParallelSpring(Effect):
    """A torque proportional to the joint's angle: a balancing spring, a cable, a cover."""

    name = "parallel_spring"
    title = "Parallel spring"
    side = Side.STRUCTURE
    family = Family.ANGLE
    limits_travel = True
    resembles = ("angle", "both_angles")
    forms_differ = "a real spring hardens, goes slack at one end, or pulls at a lever that turns"
    equation = "tau = k (q - q0) = k q - b"
    source = (
        "Wang, van Dijk, van der Kooij (2011), ICORR: spring uses in exoskeleton actuation design"
    )
    looks_like = (
        "residual against angle: a straight line, the same both ways; partly hidden in gravity and"
        " friction"
    )
    confirm = (
        "lay the machine on its side, so that gravity does not act, and hold the joint at several"
        " angles"
    )
    element = Element.SPRING
    ties: ClassVar = {
        "torque_offset": Tie(
            "a soft spring with a large preload adds little but a constant torque",
            "let the joint rest with the drive off, and unhook the spring: an offset of the sensor"
            " stays",
        ),
        "coulomb_asymmetry": Tie(
            "a soft spring with a large preload adds little but a constant torque. While the joint"
            " always moves, friction that differs with direction does the same",
            "unhook the spring, or let the joint rest: friction holds it, a spring moves it",
        ),
    }
    # The preload is linear as well; a rest angle is not, because k multiplies it.
    linear = (
        Parameter("stiffness", "N·m/rad", "torque per angle", "k", (2.0, 40.0)),
        Parameter("preload", "N·m", "stiffness times rest angle", "b", (-30.0, 30.0)),
    )
    reported = (
        linear[0],
        Parameter("rest_angle", "rad", "angle at which its torque is zero", "q0", (-1.0, 1.0)),
    )
    parity = Parity.EVEN

    @reaction
    def about_rest(at, state, values, geometry, joint, out):
        """Add k (q - q0) at the joint, with a rest angle that is no amplitude."""
        out[joint] += values[0] * (at.q[joint] - values[1])

    @reaction
    def reaction(at, state, values, geometry, joint, out):
        """Add k q - b at the joint."""
        out[joint] += values[0] * at.q[joint] - values[1]

    def __post_init__(self) -> None:
        """Set the rest angle to zero if the mechanism's parameters absorb a constant torque.

        The spring's torque at angle zero is then part of them, and no motion separates it.
        """
        super().__post_init__()
        if self.joint is None or self.on == THE_LEG:
            return
        confirm = self.confirm
        if self.on.joint(self.joint).kind == "prismatic":
            confirm = (
                "remove the drive, or switch it off, and hold the joint at several positions with a"
                " spring balance: the force of a spring grows with the travel, that of a weight is"
                " constant"
            )
        elif self.on.mechanism.has_gravity is False:
            confirm = (
                "put a spirit level on the axis first, because gravity about a leaning axis"
                " resembles a spring; then switch the drive off and hold the joint at several"
                " angles"
            )
        object.__setattr__(self, "confirm", confirm)
        if TorqueOffset.absorbed_as in self.on.mechanism.absorbs:
            assert self.reported is not None
            stiffness, rest = self.reported
            of_this = {
                "linear": (stiffness,),
                # A single form holds the rest angle: no search varies it.
                "shape": (replace(rest, default=0.0, forms=(0.0,)),),
                "reported": None,
                "reaction": self.about_rest,
            }
            for name, value in of_this.items():
                object.__setattr__(self, name, value)

    def physical(self, values: NDArray) -> NDArray:
        """Return stiffness and rest angle.

        Parameters
        ----------
        values : (2,) array
            Stiffness, N·m/rad, and preload, N·m.

        Returns
        -------
        (2,) array
            N·m/rad and rad; the angle is NaN if the stiffness is zero.
        """
        if self.reported is None:
            return super().physical(values)
        stiffness, preload = values
        return np.array([stiffness, preload / stiffness if stiffness != 0.0 else np.nan])

    def values_from(self, physical: NDArray) -> NDArray:
        """Return stiffness and preload.

        Parameters
        ----------
        physical : (2,) array
            Stiffness, N·m/rad, and rest angle, rad.

        Returns
        -------
        (2,) array
            N·m/rad and N·m.
        """
        if self.reported is None:
            return super().values_from(physical)
        stiffness, rest_angle = physical
        return np.array([stiffness, stiffness * rest_angle])
