"""``[identify]``: what the two-step fit leaves behind."""

from pydantic import Field

from pipelines.settings.base import Settings


class IdentifySettings(Settings):
    """The two-step fit: friction from exo_alone runs, then inertia with the human."""

    figures: bool = Field(True, description="Draw the figures, beside the parameters, as PNG and PDF.")
