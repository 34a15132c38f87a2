"""``residuals/1``: measured less predicted torque, run by run and model by model."""

import pyarrow as pa

from pipelines.contracts.table import Column, Contract, per_joint

RESIDUALS = Contract(
    name="residuals",
    version=1,
    purpose="measured less predicted torque",
    made_by="exoid identify",
    columns=(
        Column("file", "", "the motion file", dtype=pa.string()),
        Column("run", "", "kind of run", dtype=pa.string(), choices=("exo_alone", "with_human")),
        Column(
            "purpose", "", "what the run is for", dtype=pa.string(), choices=("train", "validate")
        ),
        Column("segment", "", "number of the stretch without gaps", dtype=pa.int64()),
        Column("time_s", "s", "device time since the recording began"),
        Column(
            "model",
            "",
            "the model that predicts",
            dtype=pa.string(),
            choices=("baseline", "extended"),
        ),
        Column("scored", "", "true where the RMSE counts the sample", dtype=pa.bool_()),
        per_joint("angle", "joint angle"),
        per_joint("velocity", "joint velocity"),
        per_joint("acceleration", "joint acceleration"),
        per_joint("torque", "measured torque, after the regression filter"),
        per_joint("predicted", "the model's torque, after the regression filter"),
        per_joint("residual", "measured less predicted torque"),
    ),
    time="time_s",
    restarts_with=("file", "model"),
)
