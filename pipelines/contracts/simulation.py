"""``simulation/1``: a closed or open loop."""

from typing import Any

from pipelines.contracts.metadata import TableKeys
from pipelines.contracts.table import Column, Contract, per_joint


class SimulationKeys(TableKeys):
    """Metadata of a simulation."""

    plant: dict[str, Any] | None = None
    controller: dict[str, Any] | None = None
    disturbance: dict[str, Any] | str | None = None
    noise: dict[str, Any] | None = None
    seed: int | None = None


SIMULATION = Contract(
    name="simulation",
    version=1,
    purpose="a closed or open loop",
    made_by="exoid simulate",
    columns=(
        Column("time_s", "s", "simulated time"),
        per_joint("reference", "desired angle"),
        per_joint("angle", "joint angle"),
        per_joint("velocity", "joint velocity"),
        per_joint("error", "reference less angle"),
        per_joint("torque", "torque at the joint, after its limit"),
        per_joint("network", "what the RBF network gives; null without one", nullable=True),
    ),
    metadata=SimulationKeys,
    time="time_s",
    is_bounded=False,
)
