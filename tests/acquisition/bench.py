"""A bench of one joint that is only read: its rig file and its mechanism."""

from pipelines.settings.mechanism import MechanismSettings

RECORDING_ONLY = """\
name = "bench"
recording_only = true
[[drive]]
joint = "elbow"
port = {port}
map = "plc"
[map.drive.plc.read]
{registers}
[safety]
watchdog_s = {watchdog_s}
connect_s = 0.5
"""
BENCH = RECORDING_ONLY.replace(
    "{registers}",
    """\
sequence = {{ address = 0, type = "uint16" }}
angle = {{ address = 1, type = "int16", scale = 1e-3, unit = "rad" }}
torque = {{ address = 2, type = "int16", scale = 0.1, unit = "N·m" }}""",
)
ELBOW = MechanismSettings.model_validate({"joints": [{"name": "elbow", "kind": "revolute"}]})
TURNING = MechanismSettings.model_validate(
    {"joints": [{"name": "elbow", "kind": "revolute", "turns": True}]}
)
