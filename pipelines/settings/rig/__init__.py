"""A rig file: devices, how to read and drive them, and the limits that stop a run."""

from pipelines.settings.rig.register import Register
from pipelines.settings.rig.rig import RigSettings, load_rig

__all__ = ["Register", "RigSettings", "load_rig"]
