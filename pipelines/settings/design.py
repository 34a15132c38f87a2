"""``[design]``: the excitation and the search for it."""

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from pipelines.settings.base import NotNegative, Positive, Settings


class Bounds(Settings):
    """Bounds of the excitation at one joint."""

    angle_rad: tuple[float, float] = Field(description="Lowest and highest angle.")
    velocity_rad_s: Positive = Field(1.6449, description="Highest speed, either way.")
    acceleration_rad_s2: Positive = Field(5.1677, description="Highest acceleration, either way.")

    @model_validator(mode="after")
    def _low_is_below_high(self) -> Self:
        low, high = self.angle_rad
        if low >= high:
            raise ValueError(
                f"angle_rad: found [{low}, {high}], expected the lowest angle first; swap them"
            )
        if max(abs(low), abs(high)) > 2 * math.pi:
            raise ValueError(
                f"angle_rad: found [{low}, {high}], expected radians, at most one turn; it looks"
                f" like degrees, write [{math.radians(low):.4f}, {math.radians(high):.4f}]"
            )
        return self


class JointBounds(Settings):
    """The bounds of each joint; defaults are the paper's Table 2."""

    # Equation 12 of the paper misprints these bounds; docs/errata.md compares it with Table 2.
    hip: Bounds = Field(Bounds(angle_rad=(0.0872, 1.2217)), description="Hip, forward positive.")
    knee: Bounds = Field(Bounds(angle_rad=(-1.6232, -0.2269)), description="Flexion negative.")


class NoiseSettings(Settings):
    """Torque noise and length of a record, for the expected standard errors."""

    # The defaults are those of a virtual rig, [plant] ripple_nm and ripple_correlation_s.
    hip_nm: Positive = Field(0.6, description="Standard deviation of the hip's torque noise.")
    knee_nm: Positive = Field(0.4, description="Standard deviation of the knee's torque noise.")
    correlation_s: NotNegative = Field(0.02, description="Time constant of the noise; 0: white.")
    duration_s: Positive = Field(40.0, description="Length of the record that will be fitted.")


class DesignSettings(Settings):
    """The excitation, a Fourier series, and the particle swarm that searches it."""

    # Its inverse is the period, after which the excitation repeats.
    base_frequency_hz: Positive = Field(0.1, description="Frequency of the first harmonic.")
    harmonics: int = Field(
        5, ge=1, le=100, description="The highest harmonic; at most 20 except of a multisine."
    )
    theta0_rad: Literal["free"] | tuple[float, float] = Field(
        "free", description='Mean angle of hip and knee, or "free" to search it too.'
    )
    criterion: Literal["log_det", "condition", "scaled_condition", "multisine"] = Field(
        "log_det",
        description="log det of A'A/N, or condition number, raw or of scaled columns; or"
        " odd harmonics with detection lines left empty.",
    )
    rest_to_rest: bool = Field(False, description="Start and end at standstill.")
    bounds: JointBounds = Field(JointBounds(), description="Of angle, speed and acceleration.")
    topology: Literal["ring", "global"] = Field("ring", description="Neighbours on a ring, or all.")
    particles: int = Field(128, ge=4, description="Size of the swarm.")
    iterations: int = Field(800, ge=1, description="Most moves of the swarm.")
    seconds: Positive = Field(60.0, description="Longest search, by this computer's clock.")
    seed: int = Field(1, ge=0, description="Seed of the search; equal seeds give equal designs.")
    sample_rate_hz: Positive = Field(200.0, description="Rows a second, in file and record.")
    noise: NoiseSettings = Field(NoiseSettings(), description="For the standard errors to expect.")

    @model_validator(mode="after")
    def _mean_angles_are_within_bounds(self) -> Self:
        if self.theta0_rad == "free":
            return self
        for name, theta0, joint in zip(
            ("hip", "knee"), self.theta0_rad, (self.bounds.hip, self.bounds.knee), strict=True
        ):
            low, high = joint.angle_rad
            if not low < theta0 < high:
                raise ValueError(
                    f"theta0_rad: found {theta0} at the {name}, expected between its bounds {low}"
                    f' and {high}; change one of them, or write "free"'
                )
        return self

    @model_validator(mode="after")
    def _harmonics_suit_the_criterion(self) -> Self:
        most_searched, least_of_multisine = 20, 5
        if self.criterion != "multisine" and self.harmonics > most_searched:
            raise ValueError(
                f"harmonics: found {self.harmonics}, expected at most {most_searched} with"
                f' criterion = "{self.criterion}"; lower it, or set criterion = "multisine"'
            )
        if self.criterion == "multisine" and self.harmonics < least_of_multisine:
            raise ValueError(
                f"harmonics: found {self.harmonics}, expected at least {least_of_multisine} with"
                ' criterion = "multisine"; fewer leave no odd harmonic empty'
            )
        return self

    @model_validator(mode="after")
    def _samples_show_the_highest_harmonic(self) -> Self:
        highest_hz = self.harmonics * self.base_frequency_hz
        if highest_hz >= 0.5 * self.sample_rate_hz:
            raise ValueError(
                f"harmonics: the highest, {self.harmonics}, is at {highest_hz:g} Hz, expected less"
                f" than half of sample_rate_hz, {0.5 * self.sample_rate_hz:g} Hz; lower harmonics"
                " or base_frequency_hz"
            )
        return self

    @model_validator(mode="after")
    def _multisine_is_never_at_rest(self) -> Self:
        if self.rest_to_rest and self.criterion == "multisine":
            raise ValueError(
                "rest_to_rest: a multisine of fixed amplitudes is never at rest; set it to false,"
                " or choose another criterion"
            )
        return self

    @model_validator(mode="after")
    def _something_moves(self) -> Self:
        if self.rest_to_rest and self.harmonics < 2:
            raise ValueError(
                "rest_to_rest: one harmonic is never at rest; set harmonics to 2 or more"
            )
        return self
