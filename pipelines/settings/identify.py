"""``[identify]``: how parameters and their intervals are fitted."""

from pydantic import Field

from pipelines.settings.base import Settings


class IdentifySettings(Settings):
    """The two-step fit: friction from exo_alone runs, then inertia with the human."""

    confidence: float = Field(0.95, gt=0.0, lt=1.0, description="Coverage of the intervals in the printed table.")
