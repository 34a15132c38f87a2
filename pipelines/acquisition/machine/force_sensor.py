"""One 3-axis cuff force sensor, as acquisition reads it."""

import time
from math import inf

from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.modbus.wraparound import Counter
from pipelines.acquisition.safety.watchdog import Watchdog
from pipelines.errors import DeviceError, Unanswered
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.devices import SensorSettings

SETTLED_S = 0.5
"""Time after which it is known how fast a sensor counts."""
LEAP = 2.0
"""How many times as fast it may count all at once, and that many samples more."""


class Sensor:
    """One 3-axis force sensor."""

    def __init__(self, rig: RigSettings, settings: SensorSettings, line: Line) -> None:
        self.settings = settings
        self.map = rig.map.sensor[settings.map]
        self.device = Device(f"sensor {settings.cuff}", settings.unit, line, rig.safety)
        self.block = Block(registers_of(self.map.read))
        self._turn = rig.turn_of(settings)
        self._watchdog = Watchdog(rig.safety.watchdog_s)
        self._in_lockstep, self._reply_s = rig.clock == "lockstep", rig.safety.longest_reply_s
        self._counter = Counter(self.block.span("sequence"))
        self._first: tuple[float, float] | None = None
        """Its first sample, and when that was told, host's clock, s."""
        self._last: tuple[float, float] | None = None
        """Its last one."""
        self._owes = False
        """Whether an answer of it may still come that another request's would be taken for."""

    def is_due(self, cycle: int) -> bool:
        """Tell whether it is read in a cycle."""
        return cycle % self.settings.every == self._turn

    async def look(self) -> tuple[float, float, float] | None:
        """Return the force (N), or None where the sensor has no new sample or, for once, does not
        answer.

        Raises
        ------
        DeviceError
            It has not answered for too long; never Unanswered, which is survived.
        """
        self._watchdog.waited(time.monotonic())
        try:
            values = self.block.decode(
                await self.device.read(self.block.address, self.block.count, in_motion=True)
            )
        except Unanswered as error:
            if self._watchdog.has_expired(time.monotonic()):
                raise DeviceError(str(error)) from error
            self._owes = not self.device.line.has_transaction_ids
            return None
        now = time.monotonic()
        self._watchdog.reset(now)
        owed, self._owes = self._owes, False
        if owed or not self._goes_on(self._counter(values["sequence"]), now):
            return None
        return values["force_x"], values["force_y"], values["force_z"]

    def _goes_on(self, count: float, now: float) -> bool:
        """Tell whether a sample is a new one; raise DeviceError where its counter went back or
        leapt."""
        if self._first is None or self._last is None:
            self._first = self._last = count, now
            return True
        last = self._last[0]
        samples = count - last
        if samples == 0:
            return False
        if samples < 0 or samples > self._most(now):
            how = "went back" if samples < 0 else "leapt"
            raise DeviceError(
                f"{self.device.label}: its sample counter {how} from {last:.0f} to {count:.0f}; was"
                " it restarted? Its zero may be another since"
            )
        self._last = count, now
        return True

    def _most(self, now: float) -> float:
        """Return how many samples it may have taken since its last new one, by how fast it counted
        until then.

        In lockstep no time passes, and until it has counted for a while, nobody knows.
        """
        assert self._first and self._last  # one came before
        (first, since), (last, until) = self._first, self._last
        if self._in_lockstep or until - since < SETTLED_S:
            return inf
        return LEAP * (1.0 + (last - first) / (until - since) * (now - until + self._reply_s))
