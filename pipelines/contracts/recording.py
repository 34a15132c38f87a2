"""``recording/1``: one run on the rig."""

import pyarrow as pa

from pipelines.contracts.metadata import RunKeys
from pipelines.contracts.table import Column, Contract, per_joint

# Null between two readings, as sensors may be read less often than drives.
CUFF_FORCES = tuple(
    Column(
        f"{segment}_{side}_force_{axis}_n",
        "N",
        f"force of the exoskeleton on the {segment}, {side} sensor, {direction}, in the segment's"
        " frame",
        required=False,
        nullable=True,
    )
    for segment in ("thigh", "shank")
    for side in ("front", "back")
    for axis, direction in (("x", "along the segment (distal)"), ("y", "forward"), ("z", "lateral"))
)

UNCHANGED = (
    per_joint("current", "motor current", required=False, nullable=True),
    per_joint("temperature", "drive or motor temperature", required=False, nullable=True),
    *CUFF_FORCES,
    Column("sequence", "", "the device's sample counter", dtype=pa.int64(), required=False),
)
"""Columns of a recording that its motion has as they are."""

RECORDING = Contract(
    name="recording",
    version=1,
    purpose="one run on the rig",
    made_by="exoid acquire",
    columns=(
        Column("time_s", "s", "device time since the recording began"),
        per_joint("angle", "measured joint angle"),
        per_joint("torque", "what the drive delivers at the joint"),
        per_joint("reference", "commanded angle", required=False, nullable=True),
        per_joint("velocity", "the drive's own velocity estimate", required=False, nullable=True),
        *UNCHANGED,
    ),
    metadata=RunKeys,
    time="time_s",
)
