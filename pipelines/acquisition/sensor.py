"""One 3-axis cuff force sensor, as acquisition reads it."""

import time

from pipelines.acquisition.device import Device
from pipelines.acquisition.line import Line
from pipelines.acquisition.patience import Patience
from pipelines.errors import DeviceError, Unanswered
from pipelines.registers import Block
from pipelines.settings.rig import RigSettings, SensorSettings, registers_of


class Sensor:
    """One 3-axis force sensor."""

    def __init__(self, rig: RigSettings, settings: SensorSettings, line: Line) -> None:
        self.settings = settings
        self.map = rig.map.sensor[settings.map]
        self.device = Device(f"sensor {settings.cuff}", settings.unit, line, rig.safety)
        self.block = Block(registers_of(self.map.read))
        self._turn = rig.turn_of(settings)
        self._patience = Patience(rig.safety.watchdog_s)
        self._last: float | None = None
        self._owes = False
        """Whether an answer of it may still come that another request's would be taken for."""

    def is_due(self, cycle: int) -> bool:
        """Tell whether it is read in a cycle."""
        return cycle % self.settings.every == self._turn

    async def look(self) -> tuple[float, float, float] | None:
        """Return the force (N), or None where the sensor has no new sample or, for once, does not answer.

        Raises
        ------
        DeviceError
            It has not answered for too long; never Unanswered, which is survived.
        """
        self._patience.waited(time.monotonic())
        try:
            told = self.block.decode(await self.device.read(self.block.address, self.block.count, in_motion=True))
        except Unanswered as error:
            if self._patience.is_over(time.monotonic()):
                raise DeviceError(str(error)) from error
            self._owes = not self.device.line.tells_replies_apart
            return None
        self._patience.hear(time.monotonic())
        owed, self._owes = self._owes, False
        stale, self._last = told["sequence"] == self._last, told["sequence"]
        return None if stale or owed else (told["force_x"], told["force_y"], told["force_z"])
