"""Whether a drive's set-point and angle have one scale; if not, it leaps when it is enabled."""

from collections.abc import Iterator

from pipelines.errors import SettingsError
from pipelines.settings.rig import Register, RigSettings
from pipelines.settings.rig.register_map import DriveMap


def refuse_contradictory_set_points(rig: RigSettings) -> None:
    """Refuse a rig with a drive that would leap from where it stands when it is enabled.

    Raises
    ------
    SettingsError
        Names both registers.
    """
    for why in set_point_contradictions(rig):
        raise SettingsError(why)


def set_point_contradictions(rig: RigSettings) -> Iterator[str]:
    """Yield, for each drive map whose set-point contradicts its angle, the error and a remedy."""
    for name in sorted({drive.map for drive in rig.drive}):
        contradiction = _contradiction(rig.map.drive[name])
        if contradiction:
            yield f"map.drive.{name}.write.reference.{contradiction}"


def _contradiction(map_: DriveMap) -> str | None:
    written, read = map_.write.reference, map_.read.angle
    if written.scale * read.scale < 0.0:
        return (
            f"scale: found {written.scale:g} with {read.scale:g} of read.angle, expected one sign,"
            " else the drive leaps when it is enabled; run `exoid rig check --by-hand`"
        )
    difference = None if map_.own_scale else _difference(written, read)
    if difference is None:
        return None
    key, one, other = difference
    return (
        f"{key}: found {one} with {other} of read.angle, expected the same, else the drive leaps"
        " when it is enabled; correct one, or set own_scale = true next to `enable`"
    )


def _difference(written: Register, read: Register) -> tuple[str, str, str] | None:
    """Return a key in which two registers of an angle differ, with both values; None for none."""
    # Relative difference of scales that are equal but for their number of digits.
    same_scale = 1e-3
    for key in ("type", "word_order", "byte_order"):
        one, other = getattr(written, key), getattr(read, key)
        if one != other and not (key == "word_order" and written.registers == 1):
            return key, one, other
    if abs(written.si[0] / read.si[0] - 1.0) > same_scale:
        if written.scale == read.scale:
            return "unit", written.unit, read.unit
        return "scale", f"{written.scale:g} {written.unit}", f"{read.scale:g} {read.unit}"
    # A difference of less than a count is lost in rounding.
    if abs(written.si[1] - read.si[1]) > max(written.step, read.step):
        return "offset", f"{written.si[1]:g} rad", f"{read.si[1]:g} rad"
    return None
