"""``motion/1``: a recording made fit for regression."""

from typing import Annotated, Any

import pyarrow as pa
from pydantic import Field

from pipelines.contracts.metadata import Keys, Positive, RunKeys
from pipelines.contracts.recording import UNCHANGED
from pipelines.contracts.table import Column, Contract, per_joint


class RegressionFilterKeys(Keys):
    """The filter that a fit applies to torque and every regressor column, segment by segment."""

    kind: str
    order: Annotated[int, Field(gt=0)] | None = None
    cutoff_hz: Positive | None = None
    decimation: Annotated[int, Field(gt=0)] | None = None
    # True where steps of time vary: whoever fits puts rows on a uniform grid first.
    over_time: bool = False


class MotionKeys(RunKeys):
    """The recording's metadata, and how it was filtered."""

    filter: dict[str, Any] | None = None
    regression_filter: RegressionFilterKeys | None = None


MOTION = Contract(
    name="motion",
    version=1,
    purpose="a recording made fit for regression",
    made_by="exoid filter",
    columns=(
        Column("time_s", "s", "device time since the recording began"),
        per_joint("angle", "joint angle after zero-phase filtering"),
        per_joint("angle_measured", "measured joint angle"),
        per_joint("velocity", "derivative of the filtered angle"),
        per_joint("acceleration", "second derivative of the filtered angle"),
        # Not filtered: a fit filters torque and regressor alike, or their relation would not hold.
        per_joint("torque", "what the drive delivers at the joint, as measured"),
        per_joint(
            "velocity_measured", "the drive's own velocity estimate", required=False, nullable=True
        ),
        per_joint("reference", "commanded angle", required=False, nullable=True),
        *UNCHANGED,
        Column("segment", "", "number of the stretch without gaps", dtype=pa.int64()),
        Column("valid", "", "false at filter edges and where data were bad", dtype=pa.bool_()),
    ),
    metadata=MotionKeys,
    time="time_s",
)
