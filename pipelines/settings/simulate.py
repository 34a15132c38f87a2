"""``[simulate]``: the adaptive RBF loop on the identified leg."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from pipelines.settings.base import NotNegative, Positive, Settings


class SimulateSettings(Settings):
    """Controller, disturbance and length of the closed loop; defaults are the reference case."""

    duration_s: Positive = Field(10.0, description="Simulated time.")
    step_s: float = Field(0.001, gt=0.0, le=0.01, description="Step of controller and integrator.")
    error_gain_1_s: Positive = Field(10.0, description="Lambda: weight of error by derivative.")
    feedback_gain_nm_s_rad: NotNegative = Field(300.0, description="Kv: feedback of the error.")
    adaptation_gain: NotNegative = Field(500.0, description="F: rate at which the weights adapt.")
    robust_gain_nm: NotNegative = Field(0.3, description="Gain of the robust (sign) term.")
    network_nodes: int = Field(7, ge=1, le=200, description="Gaussians of each joint's network.")
    network_width: Positive = Field(10.0, description="b: width of each Gaussian.")
    torque_limit_nm: Positive = Field(200.0, description="Drive limit, at which adaptation pauses.")
    disturbance_nm: NotNegative = Field(2.0, description="Amplitude of the sine disturbance.")
    disturbance_rad_s: Positive = Field(2.0, description="Frequency of the disturbance.")
    encoder_counts_per_turn: int = Field(0, ge=0, description="Of the encoder; 0 for an ideal one.")
    encoder_noise_rad: NotNegative = Field(0.0, description="RMS of the noise of each angle.")
    speed_cutoff_hz: Positive = Field(100.0, description="Low-pass of a speed from encoder steps.")
    seed: int = Field(0, ge=0, description="Seed of the encoder noise.")
    settled_after_s: NotNegative = Field(5.0, description="From here on the largest error counts.")
    sweep_nm_s_rad: tuple[Annotated[float, Field(gt=0.0)], ...] = Field(
        (50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0, 500.0),
        description="Values of Kv for the sweep of the paper's Figure 3; empty for none.",
    )
    figures: bool = Field(True, description="Draw figures next to the tables, as PNG and PDF.")

    @model_validator(mode="after")
    def _settles_before_the_end(self) -> Self:
        if self.settled_after_s >= self.duration_s:
            raise ValueError(
                f"settled_after_s: found {self.settled_after_s:g}, expected less than duration_s = "
                f"{self.duration_s:g}; lengthen the simulation"
            )
        return self
