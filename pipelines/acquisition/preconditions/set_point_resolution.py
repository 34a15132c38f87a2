"""How finely drives can be told set-points, against how far the leg moves from one to the next."""

from pipelines.errors import SettingsError
from pipelines.settings.rig import RigSettings

FINEST_SHARE = 4
"""Counts of a set-point's register in the longest step at least; rounding lengthens a step by one
of them at most."""


def refuse_coarse_set_points(rig: RigSettings, sample_rate_hz: float) -> None:
    """Refuse a drive whose set-points are rounded so coarsely that they leap though the motion is
    smooth.

    Raises
    ------
    SettingsError
        Tells the register and the coarsest count, rad, that will do.
    """
    for drive in rig.drive:
        count = rig.map.drive[drive.map].write.reference.step
        coarsest = drive.speed_rad_s / sample_rate_hz / FINEST_SHARE
        if count > coarsest:
            raise SettingsError(
                f"map.drive.{drive.map}.write.reference: one count is {count:.3g} rad, expected at"
                f" most {coarsest:.3g} rad, a quarter of what the {drive.joint} may move in a"
                f" sample ({drive.speed_rad_s:g} rad/s at {sample_rate_hz:g} Hz); correct its"
                " scale, or lower acquire.sample_rate_hz"
            )
