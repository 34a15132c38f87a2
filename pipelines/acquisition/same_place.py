"""Whether a drive is told angles as it tells them: where not, it leaps as it is enabled where the leg stands."""

from collections.abc import Iterator

from pipelines.errors import SettingsError
from pipelines.settings.rig import DriveMap, RigSettings

SAME_SCALE = 1e-3
"""Up to which share two scales are one, written with more or fewer digits."""


def refuse_misplaced_set_points(rig: RigSettings) -> None:
    """Refuse a rig with a drive that would be sent to another place than where it stands.

    Raises
    ------
    SettingsError
        Tells both registers.
    """
    for why in misplaced_set_points(rig):
        raise SettingsError(why)


def misplaced_set_points(rig: RigSettings) -> Iterator[str]:
    """Yield of each make of drives whose set-point's register contradicts its angle's what is wrong, and what to do."""
    for name in sorted({drive.map for drive in rig.drive}):
        if what := _contradiction(rig.map.drive[name]):
            yield f"map.drive.{name}.write.reference.{what}"


def _contradiction(map_: DriveMap) -> str | None:
    told, tells = map_.write.reference, map_.read.angle
    if told.scale * tells.scale < 0.0:
        return (
            f"scale: found {told.scale:g} with {tells.scale:g} of read.angle, expected one sign for both, or the drive "
            "leaps to the other side of zero as it is enabled; find out by `exoid rig check --by-hand` which is wrong, "
            "and turn that"
        )
    if map_.own_scale:
        return None
    remedy = (
        "or the drive leaps by the difference as it is enabled; correct one, or set own_scale = true beside `enable` "
        "where the drive's manual says that both are right"
    )
    if abs(told.si[1] - tells.si[1]) > max(told.step, tells.step):
        return f"offset: found {told.si[1]:g} rad with {tells.si[1]:g} rad of read.angle, expected the same, {remedy}"
    # Counts of another width or unit are fine as they are, those of the same are mostly a slip.
    alike = (told.type, told.unit) == (tells.type, tells.unit)
    if alike and abs(told.scale / tells.scale - 1.0) > SAME_SCALE:
        return f"scale: found {told.scale:g} with {tells.scale:g} of read.angle, expected the same, {remedy}"
    return None
