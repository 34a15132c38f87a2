"""``[simulate]``: the adaptive RBF loop on the identified leg."""

from pydantic import Field

from pipelines.settings.base import Settings


class SimulateSettings(Settings):
    """Controller, disturbance and length of the closed loop; defaults are the reference case."""

    duration_s: float = Field(10.0, gt=0.0, description="Simulated time.")
    step_s: float = Field(0.001, gt=0.0, description="Step of controller and integrator.")
    error_gain_1_s: float = Field(10.0, gt=0.0, description="Lambda: weight of the error beside its derivative.")
    feedback_gain_nm_s_rad: float = Field(300.0, ge=0.0, description="Kv: feedback of the filtered error.")
    adaptation_gain: float = Field(500.0, ge=0.0, description="F: how fast the network's weights adapt.")
    robust_gain_nm: float = Field(0.3, ge=0.0, description="Gain of the sign term against what the network misses.")
    torque_limit_nm: float = Field(200.0, gt=0.0, description="Drive limit; adaptation pauses while it is reached.")
    disturbance_nm: float = Field(2.0, ge=0.0, description="Amplitude of the sine disturbance on both joints.")
    disturbance_rad_s: float = Field(2.0, gt=0.0, description="Frequency of the disturbance.")
