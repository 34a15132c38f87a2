"""``[mechanism]``: the leg's geometry, used where a recording does not say its own."""

from pydantic import Field

from pipelines.settings.base import Settings


class MechanismSettings(Settings):
    """The leg's geometry, used where a recording does not say its own."""

    thigh_length_m: float = Field(0.38952, gt=0.0, description="Hip axis to knee axis; the paper's leg.")
    gravity_m_s2: float = Field(9.8, ge=0.0, description="Acceleration of gravity; the paper's value.")
