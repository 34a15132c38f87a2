"""All devices of a virtual rig and the plant behind them, latched at one instant.

In lockstep a cycle (one sample, or those of a ring from one set-point to the next) lasts until
there was one exchange with every drive (FC23: set-point in, sample out). So a run depends only on
seeds and set-points. In real time the samples follow the rig's clock, or each drive's own.
"""

import asyncio
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import SettingsError, about
from pipelines.rig.clocks import OwnClock
from pipelines.rig.device import Device, Drive, Sensor
from pipelines.rig.plant import Plant
from pipelines.rig.sealed import hidden_effects
from pipelines.rig.servo import Servo
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import DriveSettings


def build_plant(
    rig: RigSettings, path: Path, run: str, seed: int = 0, sample_rate_hz: float | None = None
) -> Plant:
    """Return the plant of a rig file with its hidden effects, for a rate of set-points.

    Raises
    ------
    SettingsError
        The file has no ``[plant]``.
    """
    if rig.plant is None:
        raise SettingsError(
            f"{path}: plant: missing, so there is no machine to simulate; add a [plant]"
        )
    hidden = hidden_effects(path.parent / rig.plant.sealed) if rig.plant.sealed else ()
    cycle_hz = sample_rate_hz or rig.plant.sample_rate_hz
    with about(path):
        device_hz = cycle_hz * rig.samples_per_cycle(cycle_hz)
        finer = 1
        if any(rig.plant.clock_ppm):
            # Devices then sample between the plant's samples, which must be close to interpolate.
            finer = max(1, round(rig.plant.drive_rate_hz / device_hz))
        return Plant(rig.plant, run, seed, hidden, device_hz * finer)


class VirtualRig:
    """All devices of a rig and the plant behind them."""

    def __init__(self, rig: RigSettings, plant: Plant, sample_rate_hz: float | None = None) -> None:
        """Begin at rest; set-points come at ``sample_rate_hz``, by default the plant's."""
        self.plant = plant
        self.lockstep = rig.clock == "lockstep"
        cycle_hz = sample_rate_hz or plant.settings.sample_rate_hz
        self.samples_per_cycle = round(plant.sample_rate_hz / cycle_hz)
        self.drives = [
            Drive(self, drive, rig.map.drive[drive.map], self._servo(rig, drive, rest))
            for drive, rest in zip(rig.drive, plant.reference, strict=True)
        ]
        self.sensors = [Sensor(self, sensor, rig.map.sensor[sensor.map]) for sensor in rig.sensor]
        self._keep_own_time(cycle_hz * rig.samples_per_cycle(cycle_hz))
        # One sample before any client connects, or the first reading would have nothing to return.
        self._advance(plant.reference)
        # Sample 0 has just been latched, so sample n is due n periods from now.
        self._began = asyncio.get_running_loop().time()

    def _keep_own_time(self, rate_hz: float) -> None:
        """Give the drives clocks of their own, where the settings have errors of clocks."""
        settings = self.plant.settings
        if any((*settings.clock_ppm, *settings.clock_offset_s)):
            for drive, ppm, offset in zip(
                self.drives, settings.clock_ppm, settings.clock_offset_s, strict=True
            ):
                drive.clock = OwnClock(ppm, offset, rate_hz, self.plant.sample_rate_hz)

    def exchanged(self, drive: Device) -> None:
        """Note an exchange with a drive; after the last one's reply the plant goes on."""
        self._waiting.discard(drive)
        if self.lockstep and not self._waiting:
            # After this request is served: its reply must hold the sample from before its
            # set-point.
            asyncio.get_running_loop().call_soon(self.catch_up)

    def catch_up(self) -> None:
        """Advance the plant to the sample that is due."""
        if self.lockstep:
            if not self._waiting:
                self._advance(self.sample.angle[0], self.samples_per_cycle)
            return
        elapsed = asyncio.get_running_loop().time() - self._began
        due = int(elapsed * self.plant.sample_rate_hz) - int(self.sample.sequence[0])
        if due > 0:
            self._advance(self.sample.angle[0], due)

    async def keep_time(self) -> None:
        """Latch samples by the rig's own clock until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            due = (
                self._began
                + (self.sample.sequence[0] + self.samples_per_cycle) / self.plant.sample_rate_hz
            )
            await asyncio.sleep(max(0.0, due - loop.time()))
            self.catch_up()

    def _servo(self, rig: RigSettings, drive: DriveSettings, rest: float) -> Servo:
        registers, deceleration = rig.map.drive[drive.map], rig.safety.deceleration_rad_s2
        rate, heartbeat_s = self.plant.sample_rate_hz, self.plant.settings.heartbeat_s
        cycle = self.samples_per_cycle
        return Servo(registers, rest, drive.angle_rad, rate, deceleration, heartbeat_s, cycle)

    def _advance(self, angle: NDArray, count: int = 1) -> None:
        """Advance by ``count`` samples without new set-points, from measured angles (J,) rad."""
        for drive in self.drives:
            drive.receive()
        # A disabled drive's set-point is the measured angle, which is the same for all of these
        # samples.
        set_points = [
            [drive.servo.next(float(angle[drive.joint])) for drive in self.drives]
            for _ in range(count)
        ]
        # `Plant.run` takes one set of enabled drives, so they are split where a drive changes.
        for enabled, following in groupby(
            set_points, lambda drives: [follows for _, follows in drives]
        ):
            references = np.array([[reference for reference, _ in drives] for drives in following])
            samples = self.plant.run(references, np.array(enabled))
            for drive in self.drives:
                drive.record(samples)
        self.sample = samples[-1:]
        self._waiting = set(self.drives)
