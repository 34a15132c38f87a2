"""To which kinds of law each effect belongs, and whether it repeats with the motion.

A diagnosis that cannot name the cause may still name its kind: the first family of an
effect is its own, the others are as good an answer.
"""

from typing import NamedTuple

FAMILIES = ("angle", "speed", "reversal", "load", "time", "transmission", "sensor", "person")


class Kind(NamedTuple):
    """Families of an effect, and whether it is the same in every period of the motion."""

    families: tuple[str, ...]
    repeats: bool = True


OF_CATALOGUE: dict[str, Kind] = {
    "stribeck_friction": Kind(("speed",)),
    "coulomb_asymmetry": Kind(("speed", "reversal")),
    "viscous_asymmetry": Kind(("speed",)),
    "load_dependent_friction": Kind(("load",)),
    "quadratic_drag": Kind(("speed",)),
    "presliding_hysteresis": Kind(("reversal",)),
    "friction_warmup": Kind(("time", "speed"), repeats=False),
    "cogging": Kind(("angle",)),
    "rotor_inertia": Kind(("transmission", "load")),
    "backlash": Kind(("transmission", "reversal")),
    "joint_elasticity": Kind(("transmission", "load")),
    "parallel_spring": Kind(("angle",)),
    "base_tilt": Kind(("angle",)),
    "mass_off_axis": Kind(("angle",)),
    "payload_change": Kind(("time", "load"), repeats=False),
    "torque_gain": Kind(("sensor", "load")),
    "torque_offset": Kind(("sensor",)),
    "torque_drift": Kind(("time", "sensor"), repeats=False),
    "encoder_offset": Kind(("sensor", "angle")),
    "time_delay": Kind(("sensor",)),
    "passive_joint_torque": Kind(("person", "angle")),
    "voluntary_torque": Kind(("person", "time"), repeats=False),
    "spasticity": Kind(("person", "speed")),
    "cuff_compliance": Kind(("person", "transmission")),
    "end_stop": Kind(("angle",)),
    "encoder_eccentricity": Kind(("sensor", "angle")),
    "torque_cross_talk": Kind(("sensor", "load")),
    "gain_drift": Kind(("time", "sensor"), repeats=False),
    "position_dependent_friction": Kind(("angle", "reversal", "speed")),
    "friction_temperature": Kind(("time", "speed"), repeats=False),
}
"""Of the catalogue's effects."""
