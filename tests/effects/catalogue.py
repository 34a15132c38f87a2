"""One plausible size of each effect: values of ``parameters`` by joint where they differ, for every
test here."""

import numpy as np

from pipelines.effects import EFFECTS
from pipelines.model import Term

SIZES = {
    "rigid_body": (2.6, 0.63, 1.78, 5.7),
    "friction": (2.5, 4.0),
    "stribeck_friction": (3.0, 0.15, 2.0),
    "coulomb_asymmetry": (1.5,),
    "viscous_asymmetry": (1.5,),
    "load_dependent_friction": (0.15, 0.5),
    "quadratic_drag": (2.0,),
    "position_dependent_friction": (1.5, 2.0, 0.4, -0.3, -1.4, -0.5),
    "presliding_hysteresis": (3.0, 0.03, 1.0),
    "friction_warmup": (3.0, 1.5, 10.0),
    "friction_temperature": (-0.3, -0.2),
    "cogging": (1.5, 11.0, 0.6),
    "rotor_inertia": (0.3,),
    "rotor_coupling": (0.04,),
    "backlash": (0.02,),
    "joint_elasticity": (600.0,),
    "parallel_spring": (10.0, -0.3),
    "end_stop": (40.0, -0.8, 1.0, 1.5),
    "base_tilt": (0.08,),
    "mass_off_axis": (0.25,),
    "payload_change": (0.4, 8.0, 0.3),
    "torque_gain": (1.15,),
    "torque_offset": (1.5,),
    "torque_drift": (0.06, 0.5),
    "gain_drift": (0.01, 0.0, 0.0),
    "torque_cross_talk": (0.1,),
    "encoder_offset": (0.06,),
    "encoder_eccentricity": (0.04, 0.6, 0.01, -1.2),
    "time_delay": (0.0175,),
    "passive_joint_torque": (15.0, -0.9, -0.25),
    "voluntary_torque": (3.0, 0.73, 0.4, 0.8),
    "spasticity": (5.0, 0.3, 1.0),
    "cuff_compliance": (600.0,),
}
AT_THE_HIP = {
    "position_dependent_friction": (1.5, 2.0, 0.4, -0.3, 0.1, 0.8),
    "end_stop": (40.0, 0.6, 1.0, 1.5),
    "passive_joint_torque": (15.0, 0.3, 0.25),
    "spasticity": (5.0, 0.15, 1.0),
}


def places(effect):
    """Return the joints an effect can have, ``None`` for the whole leg."""
    return (None,) if effect.whole_leg else effect.joints or ("hip", "knee")


def sized(effect, joint):
    """Return the effect at a joint as a term of its plausible size."""
    sizes = SIZES | (AT_THE_HIP if joint == "hip" else {})
    bound = effect(joint=joint)
    return Term(bound, bound.values_from(np.array(sizes[effect.name])))


TERMS = [
    sized(effect, joint) for effect in EFFECTS if effect.name in SIZES for joint in places(effect)
]
