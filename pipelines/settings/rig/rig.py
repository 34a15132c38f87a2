"""The whole rig file, and the limits in force in a run.

A virtual rig has a ``[plant]`` too, the machine behind its registers. No stage but the rig itself
reads that.
"""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.main import IncEx

from pipelines.errors import SettingsError
from pipelines.settings.base import Positive, Settings, load_toml
from pipelines.settings.rig import consistency
from pipelines.settings.rig.devices import (
    ControllerSettings,
    DeviceSettings,
    DriveSettings,
    JointName,
    SensorSettings,
)
from pipelines.settings.rig.geometry import GeometrySettings
from pipelines.settings.rig.line import LineSettings
from pipelines.settings.rig.plant import PlantSettings
from pipelines.settings.rig.register_map import Maps
from pipelines.settings.rig.safety import SafetySettings
from pipelines.settings.rig.safety_bounds import check_safety_bounds


class RigSettings(Settings):
    """Everything exoid knows of a rig."""

    name: Annotated[str, Field(min_length=1)] = Field(description="Name that recordings carry.")
    embedded: bool = Field(False, description="Whether `exoid acquire` starts the virtual rig.")
    clock: Literal["lockstep", "real_time"] = Field(
        "real_time", description="Devices' own clock, or (virtual rigs) a sample each exchange."
    )
    clocks: Literal["common", "own"] = Field(
        "common", description="common: one for all drives; own: one each."
    )
    sampling: Literal["cyclic", "recorder"] = Field(
        "cyclic", description="Samples come with each set-point, or from the drives' own rings."
    )
    record_rate_hz: Positive | None = Field(None, description="Samples a second in the rings.")
    drive: tuple[DriveSettings, ...] = Field(min_length=1, description="The drives.")
    sensor: tuple[SensorSettings, ...] = Field((), description="Cuff sensors, read with a human.")
    line: dict[str, LineSettings] = Field(default_factory=dict, description="Shared lines by name.")
    map: Maps = Field(description="Register maps.")
    safety: SafetySettings = Field(SafetySettings(), description="What stops a run, and how.")
    geometry: GeometrySettings = Field(GeometrySettings(), description="The leg in this rig.")
    controller: dict[JointName, ControllerSettings] = Field(
        default_factory=dict, description="The loops inside the drives."
    )
    plant: PlantSettings | None = Field(None, description="The machine behind a virtual rig.")

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        # First that every name leads to a map or a line: the later checks look them up.
        consistency.check_joints(self.drive)
        consistency.check_maps("drive", self.drive, self.map.drive)
        consistency.check_maps("sensor", self.sensor, self.map.sensor)
        consistency.check_lines(self.line, (*self.drive, *self.sensor))
        consistency.check_cuffs(self.sensor)
        self._check_virtual()
        if self.sampling == "recorder":
            consistency.check_rings(self.drive, self.map, self.record_rate_hz)
        consistency.check_saturation(self.drive, self.controller)
        if self.plant is None:  # a virtual rig has no wearer
            check_safety_bounds(self.drive, self.safety)
        consistency.check_margin(self.drive, self.safety.angle_margin_rad)
        consistency.check_set_points(self.drive, self.map, self.safety)
        consistency.check_reach(self.drive, self.sensor, self.map, self.safety)
        return self

    def _check_virtual(self) -> None:
        if self.plant is None and (self.embedded or self.clock == "lockstep"):
            raise ValueError(
                "plant: missing; a virtual rig (embedded, or in lockstep) needs a [plant]"
            )
        drifts = self.plant is not None and any((*self.plant.clock_ppm, *self.plant.clock_offset_s))
        if self.clock == "lockstep" and (self.clocks == "own" or drifts):
            raise ValueError(
                'clock: found "lockstep", in which no time goes by; clocks of their own need'
                ' "real_time"'
            )

    def line_of(self, device: DeviceSettings) -> LineSettings:
        """Return the line that a device is on."""
        return device.line_among(self.line)

    def turn_of(self, sensor: SensorSettings) -> int:
        """Return the cycle, among its ``every``, in which a sensor is read: they take turns."""
        # Sensors that are read equally often are spread over the cycles, so that all cycles take as
        # long.
        equal = [other.cuff for other in self.sensor if other.every == sensor.every]
        return equal.index(sensor.cuff) % sensor.every

    def in_force(self, run: str) -> Self:
        """Return the rig with only the limits of a run (``exo_alone`` or ``with_human``)."""
        drives = tuple(drive.in_force(run) for drive in self.drive)
        return self.model_copy(update={"drive": drives, "safety": self.safety.in_force(run)})

    def label_of(self, device: DriveSettings | SensorSettings) -> str:
        """Return a device's name in messages, with its address."""
        name = (
            f"drive {device.joint}"
            if isinstance(device, DriveSettings)
            else f"sensor {device.cuff}"
        )
        return f"{name} ({self.line_of(device).place}, unit {device.unit})"

    def samples_per_cycle(self, sample_rate_hz: float) -> int:
        """Return how many samples the drives take from one set-point to the next.

        Raises
        ------
        SettingsError
            If that is no whole number, or more than a ring can keep.
        """
        if self.sampling == "cyclic" or self.record_rate_hz is None:
            return 1
        ratio = self.record_rate_hz / sample_rate_hz
        if ratio < 1.0 or abs(ratio - round(ratio)) > 1e-9:
            raise SettingsError(
                f"record_rate_hz: found {self.record_rate_hz:g} with set-points at"
                f" {sample_rate_hz:g} Hz, expected a whole multiple"
            )
        for name, drive in self.map.drive.items():
            # While the records of one cycle are read, those of the next already overwrite the
            # oldest ones.
            if drive.ring and drive.ring.capacity and drive.ring.capacity < 2 * ratio:
                raise SettingsError(
                    f"map.drive.{name}.ring.capacity: found {drive.ring.capacity} with {ratio:.0f}"
                    f" records from one set-point to the next, expected at least {2 * ratio:.0f}."
                    " Lower record_rate_hz or raise acquire.sample_rate_hz"
                )
        return round(ratio)

    def known_geometry(self) -> dict[str, float]:
        """Return the known lengths of the leg; a virtual rig's plant fills in the others."""
        plant = (
            {name: getattr(self.plant, name) for name in GeometrySettings.model_fields}
            if self.plant
            else {}
        )
        # Measured lengths of the file count more than those of the plant.
        return plant | self.geometry.model_dump(exclude_none=True)

    def known_controllers(self) -> dict[str, dict]:
        """Return the drives' known loops; a virtual rig's plant fills in the others."""
        plant = self.plant.controllers() if self.plant else {}
        return plant | {
            joint: loop.model_dump(exclude_none=True) for joint, loop in self.controller.items()
        }

    @property
    def known_heartbeat_s(self) -> tuple[str, float | None]:
        """Key and time-out of the drives' own watchdogs, s; None where it is not known."""
        if self.safety.heartbeat_s is None and self.plant:
            return "plant.heartbeat_s", self.plant.heartbeat_s
        return "safety.heartbeat_s", self.safety.heartbeat_s

    def public(self) -> dict:
        """Return the rig's metadata: all but the plant, to be identified, and files with keys."""
        files: IncEx = {name: set(line.files) for name, line in self.line.items()}
        return self.model_dump(
            mode="json", exclude={"plant": True, "line": files}, exclude_none=True
        )


def load_rig(path: Path | str) -> RigSettings:
    """Return the rig in a file; names of files in it are relative to its folder.

    Parameters
    ----------
    path : Path or str
        A rig file.

    Raises
    ------
    SettingsError
        Names the key that is missing or wrong.
    """
    rig = load_toml(path, RigSettings)
    # Only here, as the settings themselves do not know in which folder their file is.
    lines = {name: line.with_files_in(Path(path).parent) for name, line in rig.line.items()}
    return rig.model_copy(update={"line": lines})
