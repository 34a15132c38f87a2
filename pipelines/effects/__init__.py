"""Every effect exoid knows, in plain sight. Adding one is a file and a line here."""

from pipelines.effects.effect import RUNS, Effect, Parameter, Side
from pipelines.effects.encoder_offset import EncoderOffset
from pipelines.effects.friction import Friction
from pipelines.effects.joint_elasticity import JointElasticity
from pipelines.effects.presliding_hysteresis import PreslidingHysteresis
from pipelines.effects.rigid_body import RigidBody
from pipelines.effects.stribeck_friction import StribeckFriction

EFFECTS: tuple[type[Effect], ...] = (
    RigidBody,
    Friction,
    StribeckFriction,
    PreslidingHysteresis,
    JointElasticity,
    EncoderOffset,
)

__all__ = ["EFFECTS", "RUNS", "Effect", "Parameter", "Side"]
