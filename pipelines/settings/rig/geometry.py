"""``[geometry]`` of a rig file or an import map: lengths of the leg, and gravity."""

from pydantic import Field

from pipelines.settings.base import Settings
from pipelines.settings.physical_bounds import MOST_GRAVITY_M_S2, MOST_LENGTH_M


class GeometrySettings(Settings):
    """Lengths of the leg in this rig; others come from exoid.toml."""

    thigh_length_m: float | None = Field(
        None, gt=0.0, le=MOST_LENGTH_M, description="Hip axis to knee axis."
    )
    gravity_m_s2: float | None = Field(
        None, ge=0.0, le=MOST_GRAVITY_M_S2, description="Acceleration of gravity."
    )
    thigh_cuff_distance_m: float | None = Field(
        None, gt=0.0, le=MOST_LENGTH_M, description="Hip axis to thigh cuff."
    )
    shank_cuff_distance_m: float | None = Field(
        None, gt=0.0, le=MOST_LENGTH_M, description="Knee axis to shank cuff."
    )
