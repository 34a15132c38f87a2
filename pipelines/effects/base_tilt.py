"""A machine whose base is not level."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side, Tie
from pipelines.effects.kernel import reading
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion


class BaseTilt(Effect):
    """The direction of gravity is off, and so is every segment's angle from the vertical.

    Inertia does not depend on the hip angle, so a tilt equals a shift of the hip angle's zero.
    """

    name = "base_tilt"
    title = "Base tilt"
    side = Side.STRUCTURE
    family = Family.ANGLE
    resembles = ("angle", "other_angle", "both_angles")
    forms_differ = "a real base yields under load, so its tilt changes with the motion"
    equation = "hip angle from the vertical = hip angle from the base + tilt"
    source = (
        "Hollerbach, Khalil, Gautier (2016), Springer Handbook of Robotics, ch. 6 (gravity in the"
        " base's frame)"
    )
    looks_like = "gravity torque that leads or lags the first joint's angle equally in every run"
    confirm = (
        "put a spirit level on the base, or let the machine hang freely and read its first angle"
    )
    ties: ClassVar = {
        "encoder_offset": Tie(
            "a tilted base turns gravity just as a first encoder with a shifted zero does",
            "put a spirit level on the base, or let the machine hang freely and read its first"
            " angle",
        ),
    }
    by_angle = True
    whole_leg = True
    shape = (
        Parameter("tilt", "rad", "adds to the first joint's absolute angle", "t", (-0.15, 0.15)),
    )

    @classmethod
    def possible(cls, machine: Machine) -> list[str | None]:
        """Return ``[None]`` if the first joint is revolute, and nothing otherwise."""
        # A slide has no angle that a tilt could shift.
        return super().possible(machine) if machine.joints[0].kind == "revolute" else []

    @reading
    def reading(angle, values, joint):
        """Measure the hip's angle from the base."""
        # States count from the vertical, as gravity does; the encoder counts from the base.
        angle[0] -= values[0]

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion with the hip's angle from the vertical."""
        shift = np.zeros(len(motion.joints))
        shift[0] = shape[0]
        return motion.with_state(motion.q + shift, motion.dq, motion.ddq)
