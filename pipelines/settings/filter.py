"""``[filter]``: preparation of recordings for regression."""

from typing import Annotated, Literal

from pydantic import Field

from pipelines.settings.base import Settings


class FilterSettings(Settings):
    """The zero-phase low-pass on the angle, from which derivatives are computed."""

    cutoff_hz: Literal["auto"] | Annotated[float, Field(gt=0.0)] = Field(
        "auto", description='Cut-off, or "auto": where the angle\'s spectrum meets its noise floor.'
    )
    order: int = Field(4, ge=1, le=10, description="Order of the Butterworth filter, of each pass.")
    # Torque and regressor go through the same average, which keeps the model linear
    # (docs/science.md, section 4).
    block_s: float = Field(0.025, gt=0.0, le=0.5, description="Blocks over which a fit averages.")
