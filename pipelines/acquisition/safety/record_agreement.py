"""Whether a drive's own record agrees with the answers to exchanges, sample by sample.

Each has registers of its own in the rig file. Where their scales, signs or zeros differ, one of
them is wrong; the numbers do not show which.
"""

from collections import OrderedDict
from math import copysign, isfinite, sqrt

from pipelines.acquisition.machine.reading import Reading
from pipelines.errors import DeviceError
from pipelines.settings.rig import RigSettings

COMPARED = 50
"""Samples of both accounts after which the torques' ratio is looked at."""
RATIO = 0.25
"""How far it may be from one: a record may hold a current before it was filtered, or after."""


class RecordAgreement:
    """Compares one drive's record with the answers to exchanges of the same samples."""

    def __init__(self, rig: RigSettings, joint: int, rate_hz: float) -> None:
        """Compare the record of a joint's drive, which holds samples at a rate."""
        drive = rig.drive[joint]
        self._label, self._where = rig.label_of(drive), f"map.drive.{drive.map}"
        self._rate_hz = rate_hz
        self._exchanged: OrderedDict[int, Reading] = OrderedDict()
        self._compared, self._xx, self._xy, self._yy = 0, 0.0, 0.0, 0.0

    def add(self, exchanged: Reading) -> None:
        """Take the sample of an exchange."""
        # Exchanges that wait for their record; a run that falls further behind is stopped.
        most_held = 1000
        self._exchanged[exchanged.sequence] = exchanged
        while len(self._exchanged) > most_held:
            self._exchanged.popitem(last=False)

    def check(self, recorded: Reading) -> None:
        """Compare a recorded sample with the exchange of that number.

        Parameters
        ----------
        recorded : Reading
            A sample of the drive's own record.

        Raises
        ------
        DeviceError
            Angles or torques differ.
        """
        # rms of the torque below which its noise may be all there is, on an exoskeleton.
        little_nm = 1.0
        # How far the angles of one sample may differ, on top of the joint's travel in 1.5 samples.
        near_rad = 1e-3
        exchanged = self._exchanged.pop(recorded.sequence, None)
        if exchanged is None:
            return
        apart = abs(recorded.angle - exchanged.angle)
        # NaN: nothing is known.
        if apart > near_rad + 1.5 * abs(exchanged.velocity) / self._rate_hz:
            raise DeviceError(
                f"{self._label}: reports angle {exchanged.angle:.4g} rad of sample"
                f" {recorded.sequence}, while its own record holds {recorded.angle:.4g} rad;"
                f" {self._correct('angle')}"
            )
        # Without a current in both, there is nothing to compare.
        if not isfinite(exchanged.torque * recorded.torque):
            return
        self._compared += 1
        self._xx += exchanged.torque**2
        self._xy += exchanged.torque * recorded.torque
        self._yy += recorded.torque**2
        if self._compared >= COMPARED and self._xx > self._compared * little_nm**2:
            # Of rms values: noise in its regressor would make the slope of a regression too small.
            ratio = copysign(sqrt(self._yy / self._xx), self._xy)
            if not abs(ratio - 1.0) <= RATIO:
                rms = sqrt(self._xx / self._compared)
                raise DeviceError(
                    f"{self._label}: reports a torque of {rms:.4g} N·m rms over {self._compared}"
                    f" samples, while its own record holds {ratio * rms:.4g} N·m;"
                    f" {self._correct('current')}"
                )

    def _correct(self, register: str) -> str:
        """Return the remedy where a register and its record differ."""
        return (
            f"correct scale, sign and offset of {self._where}.read.{register} or"
            f" {self._where}.ring.record.{register}"
        )
