"""The drives, their loops and the force sensors of a rig, and the line that each is on."""

from typing import Literal, Self

from pydantic import Field, model_validator

from pipelines.settings.base import Positive, Settings
from pipelines.settings.rig.with_human import TIGHTER, check_tighter, limits_in_force

JointName = Literal["hip", "knee"]


class DeviceSettings(Settings):
    """Line and unit of a device."""

    line: str | None = Field(None, description="Its table below [line]; else its own TCP line.")
    host: str = Field("127.0.0.1", description="Name or address; an embedded rig has its own.")
    port: int = Field(502, ge=1, le=65535, description="TCP port; an embedded rig chooses its own.")
    unit: int = Field(1, ge=0, le=255, description="Modbus unit id; 1 to 247 in RTU frames.")
    map: str = Field(description="Its register map, a table below [map].")

    @model_validator(mode="after")
    def _has_one_address(self) -> Self:
        for key in ("host", "port"):
            # Only keys that the file has: host and port have defaults too.
            if self.line is not None and key in self.model_fields_set:
                raise ValueError(f"{key}: found together with line = {self.line!r}; remove one")
        return self


class HumanDriveSettings(Settings):
    """Limits of a joint with a wearer; others are as without."""

    angle_rad: tuple[float, float] | None = Field(None, description="Lowest and highest angle.")
    speed_rad_s: Positive | None = Field(None, description="Highest speed, either way.")
    torque_nm: Positive | None = Field(None, description="Highest torque at the joint, either way.")


class DriveSettings(DeviceSettings):
    """A drive, its transmission, and the limits of its joint."""

    joint: JointName = Field(description="The joint it moves.")
    torque_constant_nm_a: Positive = Field(description="Motor torque per ampere.")
    gear_ratio: Positive = Field(description="Motor turns per turn of the joint.")
    angle_rad: tuple[float, float] = Field(description="Lowest and highest angle.")
    speed_rad_s: Positive = Field(description="Highest speed, either way.")
    torque_nm: Positive = Field(description="Highest torque at the joint, either way.")
    with_human: HumanDriveSettings = Field(HumanDriveSettings(), description="Limits with_human.")

    @model_validator(mode="after")
    def _limits_are_in_order(self) -> Self:
        # Here and not by `check_tighter`, which compares single numbers.
        with_human_rad = self.with_human.angle_rad or self.angle_rad
        for low, high in (self.angle_rad, with_human_rad):
            if low >= high:
                raise ValueError(
                    f"angle_rad: found [{low}, {high}], expected the lowest angle first; swap them"
                )
        low, high = with_human_rad
        if low < self.angle_rad[0] or high > self.angle_rad[1]:
            raise ValueError(
                f"with_human.angle_rad: found [{low:g}, {high:g}], expected within angle_rad"
                f" [{self.angle_rad[0]:g}, {self.angle_rad[1]:g}]; {TIGHTER}"
            )
        check_tighter(self, self.with_human, "speed_rad_s", "torque_nm")
        return self

    @property
    def torque_per_ampere(self) -> float:
        """Torque at the joint, N·m/A."""
        return self.torque_constant_nm_a * self.gear_ratio

    def in_force(self, run: str) -> Self:
        """Return the drive with the limits in force in a run (``exo_alone`` or ``with_human``)."""
        return self.model_copy(update=limits_in_force(self.with_human, run))


class SensorSettings(DeviceSettings):
    """A cuff force sensor."""

    cuff: Literal["thigh_front", "thigh_back", "shank_front", "shank_back"] = Field(
        description="Where it sits."
    )
    # 1000 cycles are the longest watchdog at 1000 cycles a second.
    every: int = Field(
        1, ge=1, le=1000, description="Cycles between two readings; equal ones take turns."
    )


class ControllerSettings(Settings):
    """The loop inside a drive, as far as it is known; it is copied into every recording."""

    type: str = Field("pd", description="Kind of loop.")
    kp_nm_rad: float | None = Field(None, description="Stiffness.")
    kd_nm_s_rad: float | None = Field(None, description="Damping.")
    rate_hz: Positive | None = Field(None, description="Rate of the loop.")
    limit_nm: Positive | None = Field(None, description="Torque at which it saturates.")
