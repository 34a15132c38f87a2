"""``candidates/1``: every cause that was tried, the best first."""

import pyarrow as pa

from pipelines.contracts.table import Column, Contract, per_joint

CANDIDATES = Contract(
    name="candidates",
    version=1,
    purpose="every cause that was tried",
    made_by="exoid diagnose",
    columns=(
        Column("rank", "", "1 is the best", dtype=pa.int64()),
        Column(
            "causes",
            "",
            "the causes tried together, each as effect@joint",
            dtype=pa.list_(pa.string()),
        ),
        Column(
            "parameters",
            "",
            "what was fitted",
            dtype=pa.list_(
                pa.struct([("name", pa.string()), ("value", pa.float64()), ("unit", pa.string())])
            ),
        ),
        Column(
            "train_score",
            "",
            "log odds against the empty set, after the validation runs judged",
            nullable=True,
        ),
        per_joint("rmse_before", "validate RMSE of the baseline", nullable=True),
        per_joint("rmse_after", "validate RMSE with the causes", nullable=True),
        Column(
            "gain_nm",
            "N·m",
            "largest reduction of the baseline's RMSE by all causes, over the joints",
            nullable=True,
        ),
        Column("gain_low_nm", "N·m", "lower end of its 95 % interval", nullable=True),
        Column("gain_high_nm", "N·m", "upper end of its 95 % interval", nullable=True),
        Column("probability", "", "how likely the causes are the true ones, 0 to 1", nullable=True),
        Column(
            "verdict",
            "",
            "decision on this set",
            dtype=pa.string(),
            choices=("named", "indistinguishable", "unlisted", "absorbed", "rejected"),
        ),
        Column("reason", "", "one sentence", dtype=pa.string()),
    ),
)
