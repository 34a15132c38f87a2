"""What a machine of another size and kind would have written of the same run."""

from dataclasses import dataclass

POWERS: dict[tuple[str, str], tuple[int, int]] = {
    ("stribeck_friction", "stribeck_torque"): (1, 0),
    ("stribeck_friction", "stribeck_velocity"): (0, 1),
    ("coulomb_asymmetry", "asymmetry"): (1, 0),
    ("viscous_asymmetry", "asymmetry"): (1, -1),
    ("load_dependent_friction", "load_coefficient"): (0, 0),
    ("quadratic_drag", "drag"): (1, -2),
    ("presliding_hysteresis", "friction_torque"): (1, 0),
    ("presliding_hysteresis", "presliding_angle"): (0, 1),
    ("friction_warmup", "viscous_drop"): (1, -1),
    ("friction_warmup", "coulomb_drop"): (1, 0),
    ("friction_warmup", "time_constant"): (0, 0),
    ("cogging", "amplitude"): (1, 0),
    ("cogging", "cycles_per_turn"): (0, -1),
    ("rotor_inertia", "inertia"): (1, -1),
    ("backlash", "play"): (0, 1),
    ("joint_elasticity", "stiffness"): (1, -1),
    ("parallel_spring", "stiffness"): (1, -1),
    ("parallel_spring", "rest_angle"): (0, 1),
    ("base_tilt", "tilt"): (0, 0),
    ("mass_off_axis", "mass_moment"): (1, 0),
    ("payload_change", "mass_moment"): (1, 0),
    ("torque_gain", "gain"): (0, 0),
    ("torque_offset", "offset"): (1, 0),
    ("torque_drift", "rate"): (1, 0),
    ("encoder_offset", "offset"): (0, 1),
    ("time_delay", "delay"): (0, 0),
    ("voluntary_torque", "amplitude"): (1, 0),
    ("voluntary_torque", "frequency"): (0, 0),
    ("spasticity", "gain"): (1, -1),
    ("spasticity", "threshold_velocity"): (0, 1),
    ("cuff_compliance", "stiffness"): (1, -1),
    ("end_stop", "stiffness"): (1, -1),
    ("end_stop", "contact_angle"): (0, 1),
    ("position_dependent_friction", "slope"): (1, -1),
    ("position_dependent_friction", "curvature"): (1, -2),
    ("gain_drift", "rate"): (0, 0),
    ("gain_drift", "time_constant"): (0, 0),
    ("encoder_eccentricity", "amplitude"): (0, 1),
    ("encoder_eccentricity", "amplitude_twice"): (0, 1),
    ("torque_cross_talk", "coupling"): (0, 0),
}
"""Powers of torque and of angle of every parameter of a cause; a missing one is refused, not
taken as it is."""


@dataclass(frozen=True)
class Units:
    """What a simulated newton metre and a simulated radian are in the recording: N·m and rad, or N
    and m."""

    torque: float = 1.0
    angle: float = 1.0

    def converted(self, effect: str, parameters: dict[str, float]) -> dict[str, float]:
        """Return parameters as the recording's units have them."""
        return {
            name: self.factor(*POWERS[effect, name]) * value for name, value in parameters.items()
        }

    def factor(self, torque: int, angle: int) -> float:
        """Return what turns a simulated value into a recorded one whose unit has these powers of
        torque and angle."""
        return self.torque**torque * self.angle**angle
