"""The elements of which model formats of simulators consist."""

from enum import Enum, auto


class Element(Enum):
    """An element with an equation; an effect of the same equation has its values, in this order.

    ================= =====================================================================
    RIGID_BODIES      inertial parameters of the mechanism
    FRICTION          Coulomb and viscous friction of a joint
    QUADRATIC_DAMPING torque of a joint per squared speed
    ARMATURE          inertia of a joint's rotor
    SPRING            stiffness and rest angle (``physical``) of a spring across a joint
    MASS_ACROSS       first moment of mass across a link
    SERIES_SPRING     stiffness and hardening of a spring between motor and link
    TORQUE_GAIN       measured torque per torque of a joint
    TORQUE_OFFSET     measured less true torque of a joint
    ================= =====================================================================
    """

    RIGID_BODIES = auto()
    FRICTION = auto()
    QUADRATIC_DAMPING = auto()
    ARMATURE = auto()
    SPRING = auto()
    MASS_ACROSS = auto()
    SERIES_SPRING = auto()
    TORQUE_GAIN = auto()
    TORQUE_OFFSET = auto()
