"""``[diagnose]``: effects of the machine that are known before a diagnosis."""

from pydantic import Field

from pipelines.settings.base import Settings


class DiagnoseSettings(Settings):
    """The diagnosis of effects that the model lacks."""

    known: tuple[str, ...] = Field(
        (), description="Effects known to be present, as `rotor_inertia@knee`, with fitted size."
    )
