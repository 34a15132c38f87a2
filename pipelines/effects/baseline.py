"""The effects that every model starts with: no diagnosis searches for them.

Other packages use these by name, and every other effect by what its class declares.
"""

from pipelines.effects.force_sensor_zero import ForceSensorZero
from pipelines.effects.friction import Friction
from pipelines.effects.rigid_body import RigidBody

__all__ = ["ForceSensorZero", "Friction", "RigidBody"]
