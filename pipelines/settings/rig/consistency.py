"""Checks over the whole rig; each raises a ValueError with key, value and remedy."""

from collections import Counter
from collections.abc import Mapping, Sequence

from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.devices import (
    ControllerSettings,
    DeviceSettings,
    DriveSettings,
    JointName,
    SensorSettings,
)
from pipelines.settings.rig.line import LineSettings
from pipelines.settings.rig.register import DIMENSION, Register
from pipelines.settings.rig.register_map import Maps
from pipelines.settings.rig.safety import SafetySettings


def check_joints(drives: Sequence[DriveSettings]) -> None:
    """Refuse all but one drive for the hip, then one for the knee.

    Parameters
    ----------
    drives : sequence of DriveSettings
        In the order of the file.

    Raises
    ------
    ValueError
        Names the joints.
    """
    joints = [drive.joint for drive in drives]
    # The order matters: column 0 of every array is the hip's, column 1 the knee's.
    if joints != ["hip", "knee"]:
        raise ValueError(
            f"drive: found {', '.join(joints)}, expected one for the hip, then one for the knee"
        )


def check_maps(kind: str, devices: Sequence[DeviceSettings], maps: Mapping[str, object]) -> None:
    """Refuse a device whose register map is missing.

    Parameters
    ----------
    kind : str
        ``drive`` or ``sensor``.
    devices : sequence of DeviceSettings
        In the order of the file.
    maps : mapping
        Maps by name.

    Raises
    ------
    ValueError
        Names the device and its map.
    """
    for i, device in enumerate(devices):
        if device.map not in maps:
            raise ValueError(
                f"{kind}[{i}].map: found {device.map!r}, expected a table below"
                f" [map.{kind}]: {', '.join(maps) or 'there is none'}"
            )


def check_lines(lines: Mapping[str, LineSettings], devices: Sequence[DeviceSettings]) -> None:
    """Refuse missing, unused and duplicate lines, and two devices at one address.

    Parameters
    ----------
    lines : mapping
        Lines by name.
    devices : sequence of DeviceSettings
        All devices of the rig.

    Raises
    ------
    ValueError
        Names the line or the address.
    """
    for device in devices:
        if device.line is not None and device.line not in lines:
            raise ValueError(
                f"line: found {device.line!r} at unit {device.unit}, expected a table below"
                f" [line]: {', '.join(lines) or 'there is none'}"
            )
    for name in lines:
        if name not in {device.line for device in devices}:
            raise ValueError(
                f'line.{name}: no device is on it; remove it, or give one line = "{name}"'
            )
    # Devices take turns on each line. Two lines to one place would send requests at the same time.
    for place, times in Counter(line.place for line in lines.values()).items():
        if times > 1:
            raise ValueError(
                f"line: two lines lead to {place}; make them one, with all its devices on it"
            )
    addresses = Counter((device.line_among(lines).place, device.unit) for device in devices)
    for (place, unit), times in addresses.items():
        if times > 1:
            raise ValueError(f"unit: two devices have {place} unit {unit}; correct one")


def check_cuffs(sensors: Sequence[SensorSettings]) -> None:
    """Refuse two sensors at one cuff."""
    for cuff, times in Counter(sensor.cuff for sensor in sensors).items():
        if times > 1:
            raise ValueError(
                f"sensor: found two sensors at {cuff}, expected one; correct their cuffs"
            )


def check_rings(drives: Sequence[DriveSettings], maps: Maps, record_rate_hz: float | None) -> None:
    """Refuse to drain rings that the drives do not have, or whose rate is missing.

    Parameters
    ----------
    drives : sequence of DriveSettings
        In the order of the file.
    maps : Maps
        Register maps.
    record_rate_hz : float or None
        Samples a second in the rings, Hz.

    Raises
    ------
    ValueError
        Names the key.
    """
    if record_rate_hz is None:
        raise ValueError(
            'record_rate_hz: missing; sampling = "recorder" needs the rate of the drives\' rings'
        )
    for i, drive in enumerate(drives):
        if maps.drive[drive.map].ring is None:
            raise ValueError(
                f'drive[{i}].map: {drive.map} has no ring, which sampling = "recorder" drains;'
                f' add [map.drive.{drive.map}.ring], or set sampling = "cyclic"'
            )


def check_saturation(
    drives: Sequence[DriveSettings], controllers: Mapping[JointName, ControllerSettings]
) -> None:
    """Refuse a torque limit that a drive cannot exceed, as it saturates below."""
    for drive in drives:
        loop = controllers.get(drive.joint)
        if loop and loop.limit_nm is not None and drive.torque_nm >= loop.limit_nm:
            raise ValueError(
                f"torque_nm: found {drive.torque_nm:g} of the {drive.joint}, expected less than its"
                f" controller.limit_nm ({loop.limit_nm:g}), at which the drive saturates; lower it"
            )


def check_margin(drives: Sequence[DriveSettings], margin_rad: float) -> None:
    """Refuse a distance from the limits that no set-point can keep.

    Parameters
    ----------
    drives : sequence of DriveSettings
        With limits, rad.
    margin_rad : float
        The distance, rad.

    Raises
    ------
    ValueError
        Names the joint and its range.
    """
    for drive in drives:
        # Limits with a wearer are within the others.
        low, high = drive.with_human.angle_rad or drive.angle_rad
        half_rad = (high - low) / 2.0
        if not margin_rad < half_rad:
            raise ValueError(
                f"safety.angle_margin_rad: found {margin_rad:g}, expected less than"
                f" {half_rad:g}, half of the {drive.joint}'s angle_rad; lower it"
            )


def check_set_points(drives: Sequence[DriveSettings], maps: Maps, safety: SafetySettings) -> None:
    """Refuse registers that cannot represent every set-point, or only too coarsely.

    Parameters
    ----------
    drives : sequence of DriveSettings
        With limits, rad.
    maps : Maps
        Register maps.
    safety : SafetySettings
        With the following error, rad.

    Raises
    ------
    ValueError
        Names the register and its range or step.
    """
    following_rad = safety.with_human.following_error_rad or safety.following_error_rad
    for drive in drives:
        register, (low, high) = maps.drive[drive.map].write.reference, drive.angle_rad
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


def check_reach(
    drives: Sequence[DriveSettings],
    sensors: Sequence[SensorSettings],
    maps: Maps,
    safety: SafetySettings,
) -> None:
    """Refuse registers that end before a limit, as a value beyond it could not be seen.

    Parameters
    ----------
    drives : sequence of DriveSettings
        With limits, rad, rad/s and N·m.
    sensors : sequence of SensorSettings
        Cuff force sensors.
    maps : Maps
        Register maps.
    safety : SafetySettings
        With the highest cuff force, N.

    Raises
    ------
    ValueError
        Names the register and the limit.
    """
    for drive in drives:
        use, most = maps.drive[drive.map], drive.torque_nm / drive.torque_per_ampere
        limits = {
            "angle": drive.angle_rad,
            "velocity": (-drive.speed_rad_s, drive.speed_rad_s),
            "current": (-most, most),
        }
        place = f"map.drive.{drive.map}"
        _check_block_reach(f"{place}.read", registers_of(use.read), limits, drive.joint)
        if use.ring:
            registers = registers_of(use.ring.record)
            _check_block_reach(f"{place}.ring.record", registers, limits, drive.joint)
    force = (-safety.cuff_force_n, safety.cuff_force_n)
    for sensor in sensors:
        registers = registers_of(maps.sensor[sensor.map].read)
        limits = dict.fromkeys(("force_x", "force_y", "force_z"), force)
        _check_block_reach(f"map.sensor.{sensor.map}.read", registers, limits, sensor.cuff)


def _check_block_reach(
    block: str,
    registers: Mapping[str, Register],
    limits: Mapping[str, tuple[float, float]],
    owner: str,
) -> None:
    """Refuse a register that cannot represent a value beyond both limits, SI."""
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
                f"{block}.{quantity}: this {register.type} can represent {low:.4g} to"
                f" {high:.4g} {unit}, but the {owner}'s limits are {lowest:.4g} to"
                f" {highest:.4g} {unit}; correct its type or scale, or lower the limits"
            )
