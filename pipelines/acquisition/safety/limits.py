"""The limits of measured values and set-points, and how set-points slow down."""

from collections.abc import Sequence
from math import copysign, isfinite, isnan

from numpy.typing import NDArray

from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.machine.row import Answers, Row
from pipelines.errors import DeviceError
from pipelines.mechanics.motion import CUFFS
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import DriveSettings, SensorSettings

HOLD_SAMPLES = 20
"""Samples for which a stopped drive holds before its torque is taken away."""


class Limits:
    """The limits of a rig, checked at every sample."""

    def __init__(
        self, rig: RigSettings, sample_rate_hz: float, sensors: Sequence[SensorSettings] = ()
    ) -> None:
        """Watch drives, and those cuff sensors that are read."""
        self._rig = rig
        self._rate = sample_rate_hz
        self._samples_per_cycle = rig.samples_per_cycle(sample_rate_hz)
        self._sensors = {CUFFS.index(sensor.cuff): sensor for sensor in sensors}
        self._cuff_read_at: dict[int, int] = {}
        """By cuff, the machine's cycle of its last new sample."""
        self._last: dict[int, Reading] = {}
        """By drive, its last sample."""

    def violation(self, samples: Row | Answers) -> str | None:
        """Return which limit samples break.

        Parameters
        ----------
        samples : Row or Answers
            One sample of each drive, as far as they answered, and cuff forces.

        Returns
        -------
        str or None
            None if they keep all.
        """
        samples_hz = self._rate * self._samples_per_cycle
        for j, (drive, reading) in enumerate(zip(self._rig.drive, samples.drives, strict=True)):
            if isinstance(reading, Reading):
                why = sample_violation(drive, self._last.get(j, reading), reading, samples_hz)
                if why:
                    return why
                self._last[j] = reading
        return self.cuff_violation(samples)

    def cuff_violation(self, samples: Row | Answers) -> str | None:
        """Return which cuff's force is above its limit, or is not measured any more."""
        first = samples.drives[0]
        cycle = first.sequence // self._samples_per_cycle if isinstance(first, Reading) else None
        return self.force_violation(samples.forces) or (
            None if cycle is None else self._silence(samples.forces, cycle)
        )

    def straying(
        self, samples: Row | Answers, set_points: Sequence[float], late: int = 0
    ) -> str | None:
        """Return which joint is too far from its set-point.

        Parameters
        ----------
        samples : Row or Answers
            One sample of each drive, as far as they answered.
        set_points : (J,) sequence of float
            rad.
        late : int, optional
            Cycles in which a drive was sent nothing, so that it may have gone on.

        Returns
        -------
        str or None
            None if none is.
        """
        for drive, reading, reference in zip(
            self._rig.drive, samples.drives, set_points, strict=True
        ):
            if not isinstance(reading, Reading):
                continue
            error = reading.angle - reference
            allowed = self._rig.safety.following_error_rad + drive.speed_rad_s * late / self._rate
            if not abs(error) <= allowed:
                return (
                    f"{drive.joint} angle {reading.angle:.3f} rad is {abs(error):.3f} rad from its"
                    f" set-point of {reference:.3f} rad, allowed are {allowed:.3g} rad"
                    " (safety.following_error_rad); is the leg blocked, or the drive without"
                    " power?"
                )
        return None

    def _silence(self, forces: NDArray, cycle: int) -> str | None:
        """Return which cuff sensor has had no new sample for too long."""
        for cuff, sensor in self._sensors.items():
            if all(map(isfinite, forces[cuff].tolist())):
                self._cuff_read_at[cuff] = cycle
            silent_s = (cycle - self._cuff_read_at.setdefault(cuff, cycle)) / self._rate
            # Between two of its turns a sensor is not read, and that is no silence.
            if silent_s > self._rig.safety.watchdog_s + sensor.every / self._rate:
                return (
                    f"watchdog: no new sample from {self._rig.label_of(sensor)} for {silent_s:.3f}"
                    f" s, allowed are {self._rig.safety.watchdog_s:g} s (safety.watchdog_s): its"
                    " counter stands still or its forces are no numbers; check its power and cable"
                )
        return None

    def force_violation(self, forces: NDArray) -> str | None:
        """Return which force is above the limit.

        Parameters
        ----------
        forces : (4, 3) array
            N; a row of NaN is a sensor without a new sample.

        Returns
        -------
        str or None
            None if none is.
        """
        most = self._rig.safety.cuff_force_n
        for cuff, force in zip(CUFFS, forces.tolist(), strict=True):
            if all(map(isnan, force)):
                continue
            for axis, value in zip("xyz", force, strict=True):
                if not abs(value) <= most:
                    return f"{cuff} force {axis} {value:.0f} N is above the limit of {most:g} N"
        return None


def sample_violation(
    drive: DriveSettings, before: Reading, reading: Reading, samples_hz: float
) -> str | None:
    """Return which limit of its joint a drive's sample breaks.

    Parameters
    ----------
    drive : DriveSettings
        With the limits: rad, rad/s and N·m.
    before, reading : Reading
        The sample before, and the sample to check.
    samples_hz : float
        Samples of the drive a second, Hz.

    Returns
    -------
    str or None
        None if it keeps them all.
    """
    low, high = drive.angle_rad
    if not low <= reading.angle <= high:
        return (
            f"{drive.joint} angle {reading.angle:.3f} rad is outside its limits {low:g} to"
            f" {high:g} rad"
        )
    speed = reading.velocity
    if isnan(speed):
        # The drive reports no velocity: the angle's change since the last sample counts.
        speed = (
            (reading.angle - before.angle) * samples_hz / max(reading.sequence - before.sequence, 1)
        )
    # Written so that a NaN breaks every limit.
    if not abs(speed) <= drive.speed_rad_s:
        return (
            f"{drive.joint} speed {speed:.3f} rad/s is above its limit of {drive.speed_rad_s:g}"
            " rad/s"
        )
    if not abs(reading.torque) <= drive.torque_nm:
        return (
            f"{drive.joint} torque {reading.torque:.1f} N·m is above its limit of"
            f" {drive.torque_nm:g} N·m"
        )
    return None


def refuse_leap(drive: DriveSettings, last: float, reference: float, allowed_s: float) -> None:
    """Refuse a set-point that no planned motion may ask for.

    It stands between the plan and the line. Whatever went wrong before, a set-point is a number,
    within its joint's limits, and no further from the last one than its speed limit leads in time.

    Parameters
    ----------
    drive : DriveSettings
        With the limits of the joint.
    last, reference : float
        The last set-point, and the one to check, rad.
    allowed_s : float
        Time to move between them, s.

    Raises
    ------
    DeviceError
        Names the joint, the set-point and the limit.
    """
    rounding_rad = 1e-9
    low, high = drive.angle_rad
    if not low <= reference <= high:
        raise DeviceError(
            f"{drive.joint}: a set-point of {reference:.3f} rad was due, outside its limits {low:g}"
            f" to {high:g} rad; it was not sent"
        )
    if not abs(reference - last) <= drive.speed_rad_s * allowed_s + rounding_rad:
        raise DeviceError(
            f"{drive.joint}: a set-point of {reference:.3f} rad was due after {last:.3f} rad with"
            f" {allowed_s:.3f} s to get there, faster than its limit of {drive.speed_rad_s:g}"
            " rad/s; it was not sent"
        )


def clamped(value: float, low: float, high: float) -> float:
    """Return the value within bounds that is nearest; NaN stays NaN."""
    # In this order a NaN stays: comparisons with it are false.
    return min(max(value, low), high)


def slowed(
    reference: float, speed: float, deceleration: float, time_s: float
) -> tuple[float, float]:
    """Return set-point and speed after some time of slowing down to rest.

    Parameters
    ----------
    reference, speed : float
        At the beginning, rad and rad/s.
    deceleration : float
        rad/s², positive.
    time_s : float
        s.

    Returns
    -------
    tuple of float
        rad and rad/s.
    """
    # Constant deceleration: v t - a t² / 2, until the speed is zero.
    moving_s = min(time_s, abs(speed) / deceleration)
    path = speed * moving_s - copysign(0.5 * deceleration * moving_s**2, speed)
    remaining = speed - copysign(deceleration * moving_s, speed) if moving_s == time_s else 0.0
    return float(reference + path), float(remaining)
