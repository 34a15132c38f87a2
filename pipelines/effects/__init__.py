"""All effects of exoid, in one tuple. A new effect needs a file and a line here."""

from pipelines.effects.backlash import Backlash
from pipelines.effects.base_tilt import BaseTilt
from pipelines.effects.cogging import Cogging
from pipelines.effects.coulomb_asymmetry import CoulombAsymmetry
from pipelines.effects.cuff_compliance import CuffCompliance
from pipelines.effects.effect import (
    RUNS,
    Effect,
    Element,
    Family,
    Parameter,
    Parity,
    Side,
    Tie,
)
from pipelines.effects.encoder_eccentricity import EncoderEccentricity
from pipelines.effects.encoder_offset import EncoderOffset
from pipelines.effects.end_stop import EndStop
from pipelines.effects.friction import Friction
from pipelines.effects.friction_temperature import FrictionTemperature
from pipelines.effects.friction_warmup import FrictionWarmup
from pipelines.effects.gain_drift import GainDrift
from pipelines.effects.joint_elasticity import JointElasticity
from pipelines.effects.load_dependent_friction import LoadDependentFriction
from pipelines.effects.mass_off_axis import MassOffAxis
from pipelines.effects.outside import effects_of_other_packages
from pipelines.effects.parallel_spring import ParallelSpring
from pipelines.effects.passive_joint_torque import PassiveJointTorque
from pipelines.effects.payload_change import PayloadChange
from pipelines.effects.position_dependent_friction import PositionDependentFriction
from pipelines.effects.presliding_hysteresis import PreslidingHysteresis
from pipelines.effects.quadratic_drag import QuadraticDrag
from pipelines.effects.rigid_body import RigidBody
from pipelines.effects.rotor_coupling import RotorCoupling
from pipelines.effects.rotor_inertia import RotorInertia
from pipelines.effects.spasticity import Spasticity
from pipelines.effects.stribeck_friction import StribeckFriction
from pipelines.effects.time_delay import TimeDelay
from pipelines.effects.torque_cross_talk import TorqueCrossTalk
from pipelines.effects.torque_drift import TorqueDrift
from pipelines.effects.torque_gain import TorqueGain
from pipelines.effects.torque_offset import TorqueOffset
from pipelines.effects.viscous_asymmetry import ViscousAsymmetry
from pipelines.effects.voluntary_torque import VoluntaryTorque

# The baseline comes first, as the pages of docs/effects say.
EFFECTS: tuple[type[Effect], ...] = (
    RigidBody,
    Friction,
    StribeckFriction,
    CoulombAsymmetry,
    ViscousAsymmetry,
    LoadDependentFriction,
    QuadraticDrag,
    PositionDependentFriction,
    PreslidingHysteresis,
    FrictionWarmup,
    FrictionTemperature,
    Cogging,
    RotorInertia,
    RotorCoupling,
    Backlash,
    JointElasticity,
    ParallelSpring,
    EndStop,
    BaseTilt,
    MassOffAxis,
    PayloadChange,
    TorqueGain,
    TorqueOffset,
    TorqueDrift,
    GainDrift,
    TorqueCrossTalk,
    EncoderOffset,
    EncoderEccentricity,
    TimeDelay,
    PassiveJointTorque,
    VoluntaryTorque,
    Spasticity,
    CuffCompliance,
)
EFFECTS += effects_of_other_packages(EFFECTS)

__all__ = [
    "EFFECTS",
    "RUNS",
    "Effect",
    "Element",
    "Family",
    "Parameter",
    "Parity",
    "Side",
    "Tie",
]
