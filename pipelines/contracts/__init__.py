"""Every table exoid reads or writes: the only interface between its stages."""

from pathlib import Path

from pipelines.contracts import parquet
from pipelines.contracts.candidates import CANDIDATES
from pipelines.contracts.joints import HIP_AND_KNEE, Joint, joints_of
from pipelines.contracts.motion import MOTION
from pipelines.contracts.parameters import PARAMETERS
from pipelines.contracts.provenance import describe
from pipelines.contracts.recording import RECORDING
from pipelines.contracts.residuals import RESIDUALS
from pipelines.contracts.simulation import SIMULATION
from pipelines.contracts.table import Column, Contract, Table
from pipelines.contracts.trajectory import TRAJECTORY
from pipelines.errors import ContractError

CONTRACTS = (TRAJECTORY, RECORDING, MOTION, PARAMETERS, RESIDUALS, CANDIDATES, SIMULATION)

__all__ = [
    "CANDIDATES",
    "CONTRACTS",
    "HIP_AND_KNEE",
    "MOTION",
    "PARAMETERS",
    "RECORDING",
    "RESIDUALS",
    "SIMULATION",
    "TRAJECTORY",
    "Column",
    "Contract",
    "Joint",
    "Table",
    "contract_of",
    "describe",
    "joints_of",
]


def contract_of(path: Path | str) -> Contract:
    """Return the contract named in a file.

    Raises
    ------
    ContractError
        If exoid does not know the contract.
    """
    _, metadata = parquet.header(Path(path))
    name = metadata["contract"].partition("/")[0]
    for contract in CONTRACTS:
        if contract.name == name:
            return contract
    known = ", ".join(contract.label for contract in CONTRACTS)
    raise ContractError(
        f"{path}: holds {metadata['contract']}, which exoid does not know; it knows {known}"
    )
