"""``[design]``: the excitation and the search for it."""

from typing import Literal, Self

from pydantic import Field, model_validator

from pipelines.settings.base import Settings


class Bounds(Settings):
    """What the excitation may ask of one joint."""

    angle_rad: tuple[float, float] = Field(description="Lowest and highest angle.")
    velocity_rad_s: float = Field(1.6449, gt=0.0, description="Highest speed, either way.")
    acceleration_rad_s2: float = Field(5.1677, gt=0.0, description="Highest acceleration, either way.")

    @model_validator(mode="after")
    def _low_is_below_high(self) -> Self:
        low, high = self.angle_rad
        if low >= high:
            raise ValueError(f"angle_rad: found [{low}, {high}], expected the lowest angle first; swap them")
        return self


class JointBounds(Settings):
    """The bounds of each joint; the paper's Table 2 unless said otherwise."""

    hip: Bounds = Field(Bounds(angle_rad=(0.0872, 1.2217)), description="Hip, forward positive.")
    knee: Bounds = Field(Bounds(angle_rad=(-1.6232, -0.2269)), description="Knee, flexion negative.")


class DesignSettings(Settings):
    """The excitation, a Fourier series, and the particle swarm that searches it."""

    base_frequency_hz: float = Field(0.1, gt=0.0, description="Frequency of the first harmonic; its period repeats.")
    harmonics: int = Field(5, ge=1, le=20, description="How many harmonics each joint has.")
    theta0_rad: Literal["free"] | tuple[float, float] = Field(
        "free", description='Mean angle of hip and knee, or "free" to search it too.'
    )
    criterion: Literal["log_det", "condition", "scaled_condition"] = Field(
        "log_det",
        description="What makes a good excitation: log det of A'A/N, or the condition number of the regressor, "
        "raw (the paper's) or with its columns scaled to unit norm.",
    )
    rest_to_rest: bool = Field(False, description="Start and end at standstill.")
    bounds: JointBounds = Field(JointBounds(), description="Angle, speed and acceleration, kept between samples too.")
    topology: Literal["ring", "global"] = Field("ring", description="Whose best each particle of the swarm follows.")
    particles: int = Field(64, ge=4, description="Size of the swarm.")
    seconds: float = Field(10.0, gt=0.0, description="Longest search, wall time.")
    seed: int = Field(1, ge=0, description="Seed of the search; equal seeds give equal designs.")
