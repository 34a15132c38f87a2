"""Whether a drive is told angles with the sign with which it tells them."""

from collections.abc import Iterator

from pipelines.errors import SettingsError
from pipelines.settings.rig import RigSettings


def refuse_mirrored_set_points(rig: RigSettings) -> None:
    """Refuse a rig with a drive that would be sent to the mirror image of where it stands: it leaps as it is enabled.

    Raises
    ------
    SettingsError
        Tells both registers.
    """
    for why in mirrored_set_points(rig):
        raise SettingsError(why)


def mirrored_set_points(rig: RigSettings) -> Iterator[str]:
    """Yield of each make of drives whose set-point has another sign than its angle what is wrong, and what to do."""
    for name in sorted({drive.map for drive in rig.drive}):
        told, tells = rig.map.drive[name].write.reference.scale, rig.map.drive[name].read.angle.scale
        if told * tells < 0.0:
            yield (
                f"map.drive.{name}.write.reference.scale: found {told:g} with {tells:g} of read.angle, expected one "
                "sign for both, or the drive leaps to the other side of zero as it is enabled; find out by "
                "`exoid rig check --by-hand` which is wrong, and turn that"
            )
