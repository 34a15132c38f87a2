"""The resolution of set-points, compared with the leg's motion from one to the next."""

from pipelines.errors import SettingsError
from pipelines.settings.rig import RigSettings


def refuse_coarse_set_points(rig: RigSettings, sample_rate_hz: float) -> None:
    """Refuse a drive whose set-points are rounded so coarsely that a smooth motion becomes jerky.

    Raises
    ------
    SettingsError
        Names the register and its largest allowed count, rad.
    """
    # Fewest counts of a set-point's register in the longest step; rounding adds one at most.
    finest_share = 4
    for drive in rig.drive:
        count = rig.map.drive[drive.map].write.reference.step
        coarsest = drive.speed_rad_s / sample_rate_hz / finest_share
        if count > coarsest:
            raise SettingsError(
                f"map.drive.{drive.map}.write.reference: one count is {count:.3g} rad, expected at"
                f" most {coarsest:.3g} rad, a quarter of the {drive.joint}'s longest step; correct"
                " its scale, or lower acquire.sample_rate_hz"
            )
