"""Whether a drive is told angles as it tells them: where not, it leaps as it is enabled where the
leg stands."""

from collections.abc import Iterator

from pipelines.errors import SettingsError
from pipelines.settings.rig import Register, RigSettings
from pipelines.settings.rig.register_map import DriveMap

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
    """Yield of each make of drives whose set-point's register contradicts its angle's what is
    wrong, and what to do."""
    for name in sorted({drive.map for drive in rig.drive}):
        if what := _contradiction(rig.map.drive[name]):
            yield f"map.drive.{name}.write.reference.{what}"


def _contradiction(map_: DriveMap) -> str | None:
    written, read = map_.write.reference, map_.read.angle
    if written.scale * read.scale < 0.0:
        return (
            f"scale: found {written.scale:g} with {read.scale:g} of read.angle, expected one sign"
            " for both, or the drive leaps to the other side of zero as it is enabled; find out by"
            " `exoid rig check --by-hand` which is wrong, and turn that"
        )
    if map_.own_scale or not (apart := _apart(written, read)):
        return None
    key, one, other = apart
    return (
        f"{key}: found {one} with {other} of read.angle, expected the same, or the drive leaps by"
        " the difference as it is enabled; correct one, or set own_scale = true beside `enable`"
        " where the drive's manual says that both are right"
    )


def _apart(written: Register, read: Register) -> tuple[str, str, str] | None:
    """Return in which key two registers differ by which one angle is another count, with both
    values, if in any."""
    for key in ("type", "word_order", "byte_order"):
        one, other = getattr(written, key), getattr(read, key)
        if one != other and not (key == "word_order" and written.registers == 1):
            return key, one, other
    if abs(written.si[0] / read.si[0] - 1.0) > SAME_SCALE:
        if written.scale == read.scale:
            return "unit", written.unit, read.unit
        return "scale", f"{written.scale:g} {written.unit}", f"{read.scale:g} {read.unit}"
    if abs(written.si[1] - read.si[1]) > max(written.step, read.step):
        return "offset", f"{written.si[1]:g} rad", f"{read.si[1]:g} rad"
    return None
