"""``[plant]`` of a virtual rig: machine, wearer and noise; pairs are of hip and knee."""

from typing import Literal

from pydantic import Field

from pipelines.settings.base import Gravity, Length, NotNegative, Positive, Settings

Pair = tuple[float, float]
Four = tuple[float, float, float, float]


class PlantEffect(Settings):
    """An effect that the plant has."""

    effect: str = Field(description="Its name, as `exoid effects` lists it.")
    joint: Literal["hip", "knee"] | None = Field(None, description="Joint; none: the whole leg.")
    values: dict[str, float] = Field(description="Its parameters by name.")


class CuffSettings(Settings):
    """Forces of the leg in its cuffs, and the noise of their sensors."""

    carried_share: float = Field(0.2, ge=0.0, le=1.0, description="Share of the weight it carries.")
    thigh_weight_n: NotNegative = Field(90.0, description="Weight of the person's thigh.")
    shank_weight_n: NotNegative = Field(50.0, description="Weight of the person's shank and foot.")
    preload_n: NotNegative = Field(15.0, description="Force of front and back on the limb.")
    noise_n: NotNegative = Field(0.5, description="RMS of each axis' noise.")
    zero_n: NotNegative = Field(0.0, description="Standard deviation of the axes' zeros.")


class TemperatureSettings(Settings):
    """Heating of the motors."""

    ambient_c: float = Field(24.0, description="Temperature of the room.")
    # °C/(N·m)²: losses in the winding grow with the square of the torque.
    heating_c_nm2: NotNegative = Field(0.01, description="Final rise per joint torque squared.")
    time_constant_s: Positive = Field(400.0, description="Of the rise.")


class PlantSettings(Settings):
    """The machine behind a virtual rig's registers."""

    # X1 and X2 are in kg·m², X3 and X4 in kg·m (docs/science.md, section 1).
    exo_inertial: Four = Field((1.0, 0.22, 0.55, 2.3), description="X1..X4 of the exoskeleton.")
    human_inertial: Four = Field((1.6, 0.41, 1.23, 3.4), description="X1..X4 of the wearer's leg.")
    coulomb_nm: Pair = Field((2.66, 4.72), description="Coulomb friction.")
    viscous_nm_s_rad: Pair = Field((4.15, 7.36), description="Viscous friction.")
    effects: tuple[PlantEffect, ...] = Field((), description="Other effects of the plant.")
    sealed: str | None = Field(None, description="File of hidden effects; see docs/rig.md.")
    thigh_length_m: Length = Field(0.38952, description="Hip axis to knee axis.")
    gravity_m_s2: Gravity = Field(9.8, description="Acceleration of gravity.")
    thigh_cuff_distance_m: Positive = Field(0.25, description="Hip axis to thigh cuff.")
    shank_cuff_distance_m: Positive = Field(0.22, description="Knee axis to shank cuff.")
    rest_rad: Pair = Field((0.0, 0.0), description="Where the leg hangs before a run.")
    sample_rate_hz: Positive = Field(200.0, description="Samples a second that the devices latch.")
    heartbeat_s: Positive | None = Field(
        None, description="Time without a set-point after which a drive disables itself."
    )
    clock_ppm: Pair = Field((0.0, 0.0), description="How much too fast each drive's clock is.")
    clock_offset_s: Pair = Field((0.0, 0.0), description="Each drive's clock at the start.")
    drive_rate_hz: Positive = Field(1000.0, description="Rate of the drives' position loops.")
    kp_nm_rad: Pair = Field((1500.0, 600.0), description="Stiffness of the position loops.")
    kd_nm_s_rad: Pair = Field((120.0, 40.0), description="Damping of the position loops.")
    limit_nm: Pair = Field((200.0, 200.0), description="Torque at which the drives saturate.")
    counts_per_turn: Pair = Field((400000.0, 400000.0), description="Of the encoder; 0: ideal.")
    # Noise of first order; the expected errors of [design.noise] assume the same.
    ripple_nm: Pair = Field((0.6, 0.4), description="RMS of the error of the measured torque.")
    ripple_correlation_s: NotNegative = Field(0.02, description="Time constant of that error.")
    cuff: CuffSettings = Field(CuffSettings(), description="The cuffs.")
    temperature: TemperatureSettings = Field(TemperatureSettings(), description="The motors.")
    seed: int = Field(0, ge=0, description="Seed of this rig's constants, as sensors' zeros.")

    def controllers(self) -> dict[str, dict]:
        """Return the drives' loops by joint, as in a recording's metadata."""
        pairs = zip(("hip", "knee"), self.kp_nm_rad, self.kd_nm_s_rad, self.limit_nm, strict=True)
        return {
            joint: {
                "type": "pd",
                "kp_nm_rad": kp,
                "kd_nm_s_rad": kd,
                "rate_hz": self.drive_rate_hz,
                "limit_nm": limit,
            }
            for joint, kp, kd, limit in pairs
        }
