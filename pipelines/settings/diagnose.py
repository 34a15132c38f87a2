"""``[diagnose]``: what is known of the machine and its recordings before a diagnosis."""

from pydantic import Field

from pipelines.contracts.fault_kind import FaultKind
from pipelines.settings.base import Settings


class DiagnoseSettings(Settings):
    """The diagnosis of effects that the model lacks."""

    known: tuple[str, ...] = Field(
        (), description="Effects known to be present, as `rotor_inertia@knee`, with fitted size."
    )
    accept: tuple[FaultKind, ...] = Field(
        (),
        description="Kinds of faults of acquisition that do not stop the diagnosis, as `clock`.",
    )
