"""``[diagnose]``: what is known of the machine before its data are looked at."""

from pydantic import Field

from pipelines.settings.base import Settings


class DiagnoseSettings(Settings):
    """The diagnosis of what the model lacks."""

    known: tuple[str, ...] = Field(
        (),
        description=(
            "What the machine's drawings show beside rigid body and friction, as"
            " `rotor_inertia@knee` or `parallel_spring@hip`: part of the model that everything is"
            " held against, its size fitted."
        ),
    )
