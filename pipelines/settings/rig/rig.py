"""The whole rig file, and the limits in force in a run.

A virtual rig has a ``[plant]`` too, the machine behind its registers. No stage but the rig itself
reads that.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.main import IncEx

from pipelines.errors import SettingsError
from pipelines.settings.base import Positive, Settings, load_toml, repeated
from pipelines.settings.rig.addresses import (
    check_maps,
    check_named_lines,
    line_of,
    secret_files,
)
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.devices import (
    ControllerSettings,
    DeviceSettings,
    DriveSettings,
    JointName,
    SensorSettings,
)
from pipelines.settings.rig.geometry import GeometrySettings
from pipelines.settings.rig.line import LineSettings, check_unit, with_files_near
from pipelines.settings.rig.plant import PlantSettings
from pipelines.settings.rig.recording_only import refuse_recording_only
from pipelines.settings.rig.register import DIMENSION
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
        self._check_joints()
        check_maps(self.map, drive=self.drive, sensor=self.sensor)
        self._check_lines()
        self._check_cuffs()
        self._check_virtual()
        self._check_rings()
        self._check_saturation()
        if self.plant is None:  # a virtual rig has no wearer
            check_safety_bounds(self.drive, self.safety)
        self._check_margin()
        self._check_set_points()
        self._check_reach()
        return self

    def _check_joints(self) -> None:
        """Refuse all but one drive for the hip, then one for the knee."""
        joints = [drive.joint for drive in self.drive]
        # The order matters: column 0 of every array is the hip's, column 1 the knee's.
        if joints != ["hip", "knee"]:
            raise ValueError(
                f"drive: found {', '.join(joints)}, expected one for the hip, then one for the knee"
            )

    def _check_lines(self) -> None:
        """Refuse missing, unused and duplicate lines, and two devices at one address."""
        devices = (*self.drive, *self.sensor)
        check_named_lines(devices, self.line)
        for name in self.line:
            if name not in {device.line for device in devices}:
                raise ValueError(
                    f'line.{name}: no device is on it; remove it, or give one line = "{name}"'
                )
        # Devices take turns on each line. Two lines to one place would send requests at the same
        # time.
        for place in repeated(line.place for line in self.line.values()):
            raise ValueError(
                f"line: two lines lead to {place}; make them one, with all its devices on it"
            )
        for device in devices:
            check_unit(device.unit, self.line_of(device), device.line)
        for place, unit in repeated((self.line_of(one).place, one.unit) for one in devices):
            raise ValueError(f"unit: two devices have {place} unit {unit}; correct one")

    def _check_cuffs(self) -> None:
        """Refuse two sensors at one cuff."""
        for cuff in repeated(sensor.cuff for sensor in self.sensor):
            raise ValueError(
                f"sensor: found two sensors at {cuff}, expected one; correct their cuffs"
            )

    def _check_virtual(self) -> None:
        if self.plant is None and (self.embedded or self.clock == "lockstep"):
            raise ValueError(
                "plant: missing; a virtual rig (embedded, or in lockstep) needs a [plant]"
            )
        own_writes = [
            drive.map for drive in self.drive if self.map.drive[drive.map].write.function != 23
        ]
        if self.clock == "lockstep" and own_writes:
            raise ValueError(
                'clock: found "lockstep", in which an FC23 exchange ends a sample, but'
                f' map.drive.{own_writes[0]}.write.function is not 23; set clock = "real_time"'
            )
        drifts = self.plant is not None and any((*self.plant.clock_ppm, *self.plant.clock_offset_s))
        if self.clock == "lockstep" and (self.clocks == "own" or drifts):
            raise ValueError(
                'clock: found "lockstep", in which no time goes by; clocks of their own need'
                ' "real_time"'
            )

    def _check_rings(self) -> None:
        """Refuse to drain rings that the drives do not have, or whose rate is missing."""
        if self.sampling == "cyclic":
            return
        if self.record_rate_hz is None:
            raise ValueError(
                "record_rate_hz: missing;"
                ' sampling = "recorder" needs the rate of the drives\' rings'
            )
        for i, drive in enumerate(self.drive):
            if self.map.drive[drive.map].ring is None:
                raise ValueError(
                    f'drive[{i}].map: {drive.map} has no ring, which sampling = "recorder" drains;'
                    f' add [map.drive.{drive.map}.ring], or set sampling = "cyclic"'
                )

    def _check_saturation(self) -> None:
        """Refuse a torque limit that a drive cannot exceed, as it saturates below."""
        for drive in self.drive:
            loop = self.controller.get(drive.joint)
            if loop and loop.limit_nm is not None and drive.torque_nm >= loop.limit_nm:
                raise ValueError(
                    f"torque_nm: found {drive.torque_nm:g} of the {drive.joint}, expected less than"
                    f" its controller.limit_nm ({loop.limit_nm:g}), at which the drive saturates;"
                    " lower it"
                )

    def _check_margin(self) -> None:
        """Refuse a distance from the limits that no set-point can keep."""
        for drive in self.drive:
            # Limits with a wearer are within the others.
            low, high = drive.with_human.angle_rad or drive.angle_rad
            half_rad = (high - low) / 2.0
            if not self.safety.angle_margin_rad < half_rad:
                raise ValueError(
                    f"safety.angle_margin_rad: found {self.safety.angle_margin_rad:g}, expected"
                    f" less than {half_rad:g}, half of the {drive.joint}'s angle_rad; lower it"
                )

    def _check_set_points(self) -> None:
        """Refuse registers that cannot represent every set-point, or only too coarsely."""
        # With a wearer the limit is the tighter one.
        following_rad = self.safety.in_force("with_human").following_error_rad
        for drive in self.drive:
            register, (low, high) = self.map.drive[drive.map].write.reference, drive.angle_rad
            if not register.holds(low, high):
                raise ValueError(
                    f"map.drive.{drive.map}.write.reference: cannot hold {low:g} to {high:g} rad,"
                    f" the {drive.joint}'s limits; correct its type or scale"
                )
            low, high = drive.with_human.angle_rad or drive.angle_rad
            # Rounding must stay a small part of the following error, or a leg that follows well is
            # stopped.
            coarsest = min(following_rad, high - low) / 4.0
            if register.step > coarsest:
                raise ValueError(
                    f"map.drive.{drive.map}.write.reference: one count is {register.step:.3g} rad,"
                    f" expected at most {coarsest:.3g} rad, a quarter of safety.following_error_rad"
                    f" or of the {drive.joint}'s range; correct its scale"
                )

    def _check_reach(self) -> None:
        """Refuse registers that end before a limit, as a value beyond it could not be seen."""
        for drive in self.drive:
            use, most = self.map.drive[drive.map], drive.torque_nm / drive.torque_per_ampere
            limits = {
                "angle": drive.angle_rad,
                "velocity": (-drive.speed_rad_s, drive.speed_rad_s),
                "current": (-most, most),
            }
            place = f"map.drive.{drive.map}"
            _check_block_reach(f"{place}.read", use.read, limits, drive.joint)
            if use.ring:
                _check_block_reach(f"{place}.ring.record", use.ring.record, limits, drive.joint)
        force = (-self.safety.cuff_force_n, self.safety.cuff_force_n)
        limits = dict.fromkeys(("force_x", "force_y", "force_z"), force)
        for sensor in self.sensor:
            block = self.map.sensor[sensor.map].read
            _check_block_reach(f"map.sensor.{sensor.map}.read", block, limits, sensor.cuff)

    def line_of(self, device: DeviceSettings) -> LineSettings:
        """Return the line that a device is on: a shared one, else its own by TCP."""
        return line_of(device, self.line)

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
        lengths = set(GeometrySettings.model_fields)
        plant = self.plant.model_dump(include=lengths) if self.plant else {}
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
        hidden: IncEx = {"plant": True, "line": secret_files(self.line)}
        return self.model_dump(mode="json", exclude=hidden, exclude_none=True)


def load_rig(path: Path | str) -> RigSettings:
    """Return the rig in a file; names of files in it are relative to its folder.

    Raises
    ------
    SettingsError
        Names the key that is missing or wrong.
    """
    refuse_recording_only(path)
    rig = load_toml(path, RigSettings)
    # Only here, as the settings themselves do not know in which folder their file is.
    return rig.model_copy(update={"line": with_files_near(rig.line, Path(path))})


def _check_block_reach(
    place: str, block: Settings, limits: Mapping[str, tuple[float, float]], owner: str
) -> None:
    """Refuse a register that cannot represent a value beyond both limits, SI."""
    registers = registers_of(block)
    for quantity, (lowest, highest) in limits.items():
        register = registers.get(quantity)
        if register is None:
            continue
        low, high = register.span
        # Strictly: a register that ends at the limit saturates there, so its value never breaks the
        # limit.
        if not (low < lowest and highest < high):
            unit = DIMENSION[quantity][0]
            raise ValueError(
                f"{place}.{quantity}: this {register.type} can represent {low:.4g} to"
                f" {high:.4g} {unit}, but the {owner}'s limits are {lowest:.4g} to"
                f" {highest:.4g} {unit}; correct its type or scale, or lower the limits"
            )
