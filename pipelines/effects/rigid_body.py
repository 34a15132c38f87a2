"""The rigid links of the machine, with everything that moves along with them."""

import numpy as np
from numpy.typing import NDArray

from pipelines.effects.effect import Effect, Element, Family, Parameter, Parity, Side
from pipelines.mechanics.mechanism import Mechanism
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.motion import Motion


def _parameters(mechanism: Mechanism) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(p.name, p.unit, p.meaning, p.name, p.typical) for p in mechanism.parameters
    )


def _equation(mechanism: Mechanism) -> str:
    return (
        "tau = M(q) ddq + C(q, dq) dq + G(q) = A(q, dq, ddq)"
        f" ({', '.join(p.name for p in mechanism.parameters)})"
    )


class RigidBody(Effect):
    """Inertia, Coriolis, centrifugal and gravity torque of the links.

    Equation and parameters of the class are the leg's.
    """

    name = "rigid_body"
    title = "Rigid body"
    side = Side.STRUCTURE
    family = Family.ANGLE
    resembles = ("inertia_by_angle", "angle", "other_angle", "both_angles")
    forms_differ = "real links bend a little, and cables and hoses pull at them"
    equation = _equation(LEG)
    source = "Lagrange's equations of a planar double pendulum, docs/errata.md"
    looks_like = "torque in step with acceleration and with gravity; every fit starts with it"
    confirm = "weigh the links, or hold the machine still at several angles and read the torque"
    mechanism_equation = "rigid_bodies"
    element = Element.RIGID_BODIES
    whole_leg = True
    inertial = True
    parity = Parity.EVEN
    linear = _parameters(LEG)
    reaction = staticmethod(LEG.reactions[mechanism_equation])

    def __post_init__(self) -> None:
        """Use the machine's own parameters."""
        super().__post_init__()
        object.__setattr__(self, "linear", _parameters(self.on.mechanism))
        object.__setattr__(self, "equation", _equation(self.on.mechanism))

    def columns(self, motion: Motion, shape: NDArray | tuple[float, ...] = ()) -> NDArray:
        """Return the mechanism's regressor, (n, J, p), in one pass."""
        if not self.explains(motion):
            return np.zeros((*motion.q.shape, len(self.linear)))
        # The kernel of the reaction would take one pass for each parameter.
        return self.on.mechanism.regressor(motion.q, motion.dq, motion.ddq, motion.geometry)
