"""Whether the drives' own watchdogs tolerate a lost reply, which delays the next set-point."""

from pipelines.errors import SettingsError
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import DriveSettings


def refuse_short_heartbeat(rig: RigSettings, sample_rate_hz: float, *, with_sensors: bool) -> None:
    """Refuse drives whose watchdog would let go of the leg after a single lost reply.

    Nothing is refused where the time-outs of their watchdogs are unknown.

    Raises
    ------
    SettingsError
        Names the time-out and its shortest allowed value.
    """
    key, heartbeat_s = rig.known_heartbeat_s
    for drive in rig.drive:
        waits = replies_waited_for(rig, drive, with_sensors=with_sensors)
        reply_s = rig.safety.longest_reply_s
        longest = waits * reply_s + 2.0 / sample_rate_hz
        if heartbeat_s is not None and heartbeat_s <= longest:
            raise SettingsError(
                f"{key}: found {heartbeat_s:g}, expected more than {longest:.3g} s, for which one"
                f" lost reply leaves {rig.label_of(drive)} without a set-point ({waits} x reply_s,"
                " and two samples); lower safety.reply_s, or raise the time-out in the drive"
            )


def replies_waited_for(rig: RigSettings, drive: DriveSettings, *, with_sensors: bool) -> int:
    """Return the time-outs that pass until a drive is sent something after a lost reply.

    A second one passes where other devices are on its line, or where its late reply could be taken
    for that of the next request: see ``Line``.
    """
    on_line = [
        other
        for other in (*rig.drive, *(rig.sensor if with_sensors else ()))
        if other.line == drive.line
    ]
    shared = drive.line is not None and len(on_line) > 1
    return 2 if shared or not rig.line_of(drive).has_transaction_ids else 1
