"""How long a lost reply leaves a drive without a set-point, against how long its own watchdog waits
for one."""

from pipelines.errors import SettingsError
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import DriveSettings


def refuse_short_heartbeat(rig: RigSettings, sample_rate_hz: float, *, with_sensors: bool) -> None:
    """Refuse drives that would let go of the leg because of one lost reply, which a run survives.

    Nothing is refused where it is not known how long their watchdogs wait.

    Raises
    ------
    SettingsError
        Tells the time-out, and how long it should be.
    """
    key, heartbeat_s = rig.known_heartbeat_s
    for drive in rig.drive:
        waits = replies_waited_for(rig, drive, with_sensors=with_sensors)
        reply_s = rig.safety.longest_reply_s
        longest = waits * reply_s + 2.0 / sample_rate_hz
        if heartbeat_s is not None and heartbeat_s <= longest:
            raise SettingsError(
                f"{key}: found {heartbeat_s:g}, expected more than {longest:.3g} s: for so long one"
                f" lost reply leaves {rig.label_of(drive)} without a set-point ({waits} x reply_s"
                f" of {reply_s:.3g} s, and two samples), and its own watchdog would let go of the"
                " leg; lower safety.reply_s, or raise the time-out in the drive"
            )


def replies_waited_for(rig: RigSettings, drive: DriveSettings, *, with_sensors: bool) -> int:
    """Return how many replies' time goes by until a drive is told again whose reply was lost.

    Where others are on its line, or its reply could be taken for another's, it is left alone for as
    long as it was waited for: see ``Line``.
    """
    on_line = [
        other
        for other in (*rig.drive, *(rig.sensor if with_sensors else ()))
        if other.line == drive.line
    ]
    shared = drive.line is not None and len(on_line) > 1
    return 2 if shared or not rig.line_of(drive).has_transaction_ids else 1
