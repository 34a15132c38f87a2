"""``[investigate]``: how long to go on where a verdict leaves a choice of causes."""

from pydantic import Field

from pipelines.settings.base import Positive, Settings


class InvestigateSettings(Settings):
    """The budget of further experiments."""

    runs: int = Field(12, ge=0, description="Most runs to record in addition to every [[run]].")
    minutes: Positive = Field(30.0, description="Most minutes that these runs move the leg.")
    least_probability: float = Field(
        0.05, ge=0.0, le=1.0, description="A motion less likely to decide is not recorded."
    )
