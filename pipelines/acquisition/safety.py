"""What stops a run, and how a drive is stopped."""

import asyncio
import time

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.machine import Drive, Row
from pipelines.errors import DeviceError
from pipelines.mechanics.motion import CUFFS
from pipelines.settings.rig import RigSettings

HOLD_SAMPLES = 20
"""Samples for which a stopped drive holds before its torque is taken away."""


class Limits:
    """The limits of a rig, checked at every sample."""

    def __init__(self, rig: RigSettings, sample_rate_hz: float) -> None:
        self._rig = rig
        self._rate = sample_rate_hz
        self._last: Row | None = None

    def violation(self, row: Row) -> str | None:
        """Return which limit a sample breaks, None if it keeps them all."""
        last, self._last = self._last, row
        for j, (drive, found) in enumerate(zip(self._rig.drive, row.drives, strict=True)):
            low, high = drive.angle_rad
            if not low <= found.angle <= high:
                return f"{drive.joint} angle {found.angle:.3f} rad is outside its limits {low:g} to {high:g} rad"
            speed = found.velocity
            if np.isnan(speed) and last is not None and row.sequence > last.sequence:
                # The drive tells no speed: what the angle did since the last sample.
                step = found.angle - last.drives[j].angle
                speed = step * self._rate / (row.sequence - last.sequence)
            if abs(speed) > drive.speed_rad_s:
                return f"{drive.joint} speed {speed:.3f} rad/s is above its limit of {drive.speed_rad_s:g} rad/s"
            if abs(found.torque) > drive.torque_nm:
                return f"{drive.joint} torque {found.torque:.1f} N·m is above its limit of {drive.torque_nm:g} N·m"
        return self._force_violation(row.forces)

    def _force_violation(self, forces: NDArray) -> str | None:
        high = np.abs(forces) > self._rig.safety.cuff_force_n  # NaN, a sensor not read, is never high
        if not high.any():
            return None
        cuff, axis = np.argwhere(high)[0]
        return (
            f"{CUFFS[cuff]} force {'xyz'[axis]} {forces[cuff, axis]:.0f} N is above the limit of "
            f"{self._rig.safety.cuff_force_n:g} N"
        )


async def stop(drive: Drive, reference: float, speed: float, deceleration: float, sample_rate_hz: float) -> str | None:
    """Bring one drive to rest and take its torque away, whatever happens to the others.

    Parameters
    ----------
    reference, speed : float
        Last set-point that was sent, rad, and its speed, rad/s.
    deceleration : float
        rad/s².

    Returns
    -------
    str or None
        Why it could not be disabled.
    """
    last, due = reference, time.perf_counter()
    try:
        for last in slowing(reference, speed, deceleration, sample_rate_hz, drive.settings.angle_rad).tolist():
            await drive.exchange(last)
            # On the host's clock: the device's counter may be what has failed.
            due += 0.0 if drive.in_lockstep else 1.0 / sample_rate_hz
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
    except DeviceError:
        pass  # it may still hear that it shall disable
    try:
        await drive.disable(last)
    except DeviceError as error:
        return str(error)
    return None


def slowing(
    reference: float, speed: float, deceleration: float, sample_rate_hz: float, limits: tuple[float, float]
) -> NDArray:
    """Return set-points (n,) that slow down to rest and hold there, never beyond the limits, rad."""
    moving = int(np.ceil(abs(speed) / deceleration * sample_rate_hz))
    time = np.minimum(np.arange(1, moving + HOLD_SAMPLES + 1) / sample_rate_hz, abs(speed) / deceleration)
    path = reference + np.sign(speed) * (abs(speed) * time - 0.5 * deceleration * time**2)
    return np.clip(path, *limits)
