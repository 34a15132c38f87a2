"""A machine that does not stand upright."""

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Family, Parameter, Side
from pipelines.effects.kernel import reading
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion


class BaseTilt(Effect):
    """Gravity's direction is off, so every segment's angle from the vertical is.

    Inertia does not depend on the hip angle: a tilt is the same as a hip angle counted from another
    direction.
    """

    name = "base_tilt"
    title = "Base tilt"
    side = Side.STRUCTURE
    family = Family.ANGLE
    resembles = ("angle", "other_angle", "both_angles")
    forms_differ = "a real base gives way under load, so its tilt changes with the motion"
    equation = "hip angle from the vertical = hip angle from the base + tilt"
    source = (
        "Hollerbach, Khalil, Gautier (2016), Springer Handbook of Robotics, ch. 6 (gravity in the"
        " base's frame)"
    )
    looks_like = "gravity torque that leads or lags the first joint's angle in every run alike"
    confirm = (
        "put a spirit level on the base, or let the machine hang freely and read its first angle"
    )
    by_angle = True
    whole_leg = True
    shape = (
        Parameter("tilt", "rad", "adds to the first joint's absolute angle", "t", (-0.15, 0.15)),
    )

    @classmethod
    def possible(cls, machine: Machine) -> list[str | None]:
        """Return it where the first joint turns: a tilt adds to an angle, not to where a slide
        stands."""
        return super().possible(machine) if machine.joints[0].kind == "revolute" else []

    @reading
    def reading(angle, values, joint):
        """Count the hip's angle from the base."""
        angle[0] -= values[0]

    def corrected(self, motion: Motion, shape: NDArray | tuple[float, ...]) -> Motion:
        """Return the motion with the hip's angle from the vertical."""
        shift = np.zeros(len(motion.joints))
        shift[0] = shape[0]
        return motion.with_state(motion.q + shift, motion.dq, motion.ddq)
