"""A rig file of a machine that its own controller moves: exoid reads it, and writes nothing."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.main import IncEx

from pipelines.errors import SettingsError
from pipelines.settings.base import Positive, Settings, load_toml
from pipelines.settings.rig.addresses import (
    check_maps,
    check_named_lines,
    line_of,
    secret_files,
)
from pipelines.settings.rig.block import ReadBlock, check_block, registers_of
from pipelines.settings.rig.devices import ControllerSettings, DeviceSettings, SensorSettings
from pipelines.settings.rig.geometry import GeometrySettings
from pipelines.settings.rig.line import LineSettings, check_unit, with_files_near
from pipelines.settings.rig.register import Register
from pipelines.settings.rig.register_map import Identity
from pipelines.validation.toml import read_toml


class RecordedJoint(DeviceSettings):
    """A joint, and the device that measures it."""

    joint: str = Field(pattern="^[a-z][a-z0-9_]*$", description="Its name in the recording.")
    torque_constant_nm_a: Positive | None = Field(None, description="Motor torque per ampere.")
    gear_ratio: Positive | None = Field(None, description="Motor turns per turn of the joint.")


class RecordedAngle(Register):
    """The angle of a joint, which may start again after each turn."""

    wraps_at: Positive | None = Field(
        None, description="Count at which it starts again at 0: 3600 in tenths of a degree."
    )

    @property
    def turn(self) -> float:
        """SI value after which it starts again at 0; 0 where it goes on."""
        return abs(self.si[0]) * (self.wraps_at or 0.0)


class RecordedRead(ReadBlock):
    """Values of a joint; without a counter or clock, this computer's clock counts."""

    angle: RecordedAngle = Field(description="Joint angle.")
    torque: Register | None = Field(None, description="Torque at the joint; or current.")
    current: Register | None = Field(None, description="Motor current; or torque.")
    sequence: Register | None = Field(None, description="Sample counter.")
    time: Register | None = Field(None, description="The device's clock at the sample.")
    velocity: Register | None = Field(None, description="The device's own velocity estimate.")
    temperature: Register | None = Field(None, description="Drive or motor temperature.")
    reference: Register | None = Field(None, description="The controller's set-point.")


class RecordedForces(ReadBlock):
    """Values of a 3-axis force sensor; axes as in docs/contracts.md."""

    sequence: Register | None = Field(None, description="Sample counter.")
    force_x: Register = Field(description="Force along the segment (distal).")
    force_y: Register = Field(description="Force forward.")
    force_z: Register = Field(description="Lateral force.")


class JointMap(Settings):
    """Registers of a make of devices that measure a joint."""

    identity: tuple[Identity, ...] = Field((), description="Registers that identify the make.")
    read: RecordedRead = Field(description="Block that is read.")

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        check_block(self.read, "read")
        if (self.read.torque is None) == (self.read.current is None):
            raise ValueError("read: expected torque or current, one of them")
        if self.read.time is not None and self.read.sequence is None:
            raise ValueError(
                "read.time: needs read.sequence, which numbers the samples; add it, or leave out"
                " time and this computer's clock counts"
            )
        return self


class ForceMap(Settings):
    """Registers of a make of force sensors."""

    identity: tuple[Identity, ...] = Field((), description="Registers that identify the make.")
    read: RecordedForces = Field(description="Block that is read.")

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        check_block(self.read, "read")
        return self


class RecordedMaps(Settings):
    """Register maps by name."""

    drive: dict[str, JointMap] = Field(description="Maps of joints.")
    sensor: dict[str, ForceMap] = Field(default_factory=dict, description="Maps of force sensors.")


class WaitSettings(Settings):
    """How long answers are awaited."""

    watchdog_s: Positive = Field(1.0, description="Longest time without a whole sample.")
    reply_s: Positive | None = Field(None, description="Wait for a reply; else 0.3 of watchdog_s.")
    connect_s: Positive = Field(5.0, description="Longest wait for a line or its first reply.")

    @property
    def longest_reply_s(self) -> float:
        """Longest wait for one reply while a recording goes on, s."""
        return 0.3 * self.watchdog_s if self.reply_s is None else self.reply_s


class RecordingRig(Settings):
    """A machine that exoid reads only."""

    name: Annotated[str, Field(min_length=1)] = Field(description="Name that recordings carry.")
    recording_only: Literal[True] = Field(description="true: exoid moves and writes nothing.")
    drive: tuple[RecordedJoint, ...] = Field(min_length=1, description="The joints.")
    sensor: tuple[SensorSettings, ...] = Field((), description="Cuff force sensors.")
    line: dict[str, LineSettings] = Field(default_factory=dict, description="Lines by name.")
    map: RecordedMaps = Field(description="Register maps.")
    safety: WaitSettings = Field(WaitSettings(), description="How long answers are awaited.")
    geometry: GeometrySettings = Field(GeometrySettings(), description="The leg in this rig.")
    controller: dict[str, ControllerSettings] = Field(
        default_factory=dict, description="The loops that move the joints."
    )

    @property
    def embedded(self) -> bool:
        """False: a virtual rig has no controller of its own that would move it."""
        return False

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        names = [joint.joint for joint in self.drive]
        if len(set(names)) < len(names):
            raise ValueError(f"drive: found {', '.join(names)}, expected each joint once")
        devices = (*self.drive, *self.sensor)
        check_maps(self.map, drive=self.drive, sensor=self.sensor)
        check_named_lines(devices, self.line)
        for one in devices:
            check_unit(one.unit, self.line_of(one), one.line)
        for i, joint in enumerate(self.drive):
            scaled = joint.torque_constant_nm_a is not None and joint.gear_ratio is not None
            if self.map.drive[joint.map].read.torque is None and not scaled:
                raise ValueError(
                    f"drive[{i}]: torque_constant_nm_a and gear_ratio are missing, which turn its"
                    " current into the joint's torque"
                )
        return self

    def line_of(self, device: DeviceSettings) -> LineSettings:
        """Return the line that a device is on: a shared one, else its own by TCP."""
        return line_of(device, self.line)

    def quantities_of(self, joint: RecordedJoint) -> tuple[str, ...]:
        """Return the quantities that a recording has of a joint."""
        named = set(registers_of(self.map.drive[joint.map].read)) - {"sequence", "time"}
        order = ("angle", "torque", "reference", "velocity", "current", "temperature")
        return tuple(name for name in order if name in named | {"torque"})

    def public(self) -> dict:
        """Return the rig's metadata: all but files with keys."""
        hidden: IncEx = {"line": secret_files(self.line)}
        return self.model_dump(mode="json", exclude=hidden, exclude_none=True)


def is_recording_only(path: Path | str) -> bool:
    """Return whether a rig file is of a machine that exoid only reads."""
    try:
        return "recording_only" in read_toml(Path(path))
    except (OSError, ValueError):  # `load_rig` says what is wrong with it
        return False


def load_recording_rig(path: Path | str) -> RecordingRig:
    """Return the recording-only rig in a file; names of files in it are relative to its folder.

    Raises
    ------
    SettingsError
        Names the key that is missing or wrong.
    """
    rig = load_toml(path, RecordingRig)
    return rig.model_copy(update={"line": with_files_near(rig.line, Path(path))})


def refuse_recording_only(path: Path | str) -> None:
    """Refuse to move a machine that exoid only reads.

    Raises
    ------
    SettingsError
        Names the file.
    """
    if is_recording_only(path):
        raise SettingsError(
            f"{path}: is recording_only, and this command moves the machine; use `exoid acquire`,"
            " which only reads it"
        )
