"""Conditions for moving a person: limits of their own, and watched cuff forces."""

from pipelines.errors import SettingsError
from pipelines.settings.rig import RigSettings


def unmonitored(rig: RigSettings) -> list[str]:
    """Return in words which dangers go unnoticed on a rig while it moves a person."""
    missing = []
    if not rig.sensor:
        missing.append(
            "the rig file has no [[sensor]]: the force on the cuffs is not watched; add the sensors"
        )
    blind = [drive.joint for drive in rig.drive if not rig.map.drive[drive.map].enabled_mask]
    if blind:
        missing.append(
            f"the rig file has no enabled_mask for the drive of {' and '.join(blind)}: an emergency"
            " stop that is pressed and released is noticed only by safety.following_error_rad"
            f" ({rig.safety.in_force('with_human').following_error_rad:g}"
            " rad), by which the leg may leap on the release; add enabled_mask and enabled_value"
        )
    deaf = [drive.joint for drive in rig.drive if not rig.map.drive[drive.map].fault_mask]
    if deaf:
        missing.append(
            f"the rig file has no fault_mask for the drive of {' and '.join(deaf)}: its fault is"
            " noticed only if it then reports that it is not enabled, or the leg does not follow;"
            " add fault_mask"
        )
    return missing


def refuse_unguarded(rig: RigSettings, sample_rate_hz: float) -> None:
    """Refuse to move a person by a rig whose file has no limits of their own.

    A virtual rig is not refused: no person is in it.

    Raises
    ------
    SettingsError
        Names the missing key, or a sensor that is read too seldom.
    """
    limits = ("speed_rad_s", "torque_nm")
    if rig.plant is not None:
        return
    for i, drive in enumerate(rig.drive):
        for limit in limits:
            if getattr(drive.with_human, limit) is None:
                raise SettingsError(
                    f"drive[{i}].with_human.{limit}: missing; a run with_human needs the"
                    f" {drive.joint}'s own limit, no higher than {getattr(drive, limit):g}"
                )
    if rig.sensor and rig.safety.with_human.cuff_force_n is None:
        raise SettingsError(
            "safety.with_human.cuff_force_n: missing; a run with_human needs its own limit of the"
            f" force on a cuff, no higher than {rig.safety.cuff_force_n:g} N"
        )
    refuse_rare_readings(rig, sample_rate_hz)


def refuse_rare_readings(rig: RigSettings, sample_rate_hz: float) -> None:
    """Refuse sensors that are read less often than the watchdog's time.

    Raises
    ------
    SettingsError
        Names the sensor.
    """
    for i, sensor in enumerate(rig.sensor):
        if sensor.every > rig.safety.watchdog_s * sample_rate_hz:
            raise SettingsError(
                f"sensor[{i}].every: found {sensor.every}, which is"
                f" {sensor.every / sample_rate_hz:.3g} s at {sample_rate_hz:g} Hz; expected a force"
                f" at least every {rig.safety.watchdog_s:g} s (safety.watchdog_s); lower it"
            )
