"""``[geometry]`` of a rig file or an import map: lengths of the leg, and gravity."""

from pydantic import Field

from pipelines.settings.base import Gravity, Length, Settings


class GeometrySettings(Settings):
    """Lengths of the leg in this rig; others come from exoid.toml."""

    thigh_length_m: Length | None = Field(None, description="Hip axis to knee axis.")
    gravity_m_s2: Gravity | None = Field(None, description="Acceleration of gravity.")
    thigh_cuff_distance_m: Length | None = Field(None, description="Hip axis to thigh cuff.")
    shank_cuff_distance_m: Length | None = Field(None, description="Knee axis to shank cuff.")
