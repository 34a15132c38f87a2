"""One 3-axis cuff force sensor, as acquisition reads it."""

import time
from math import inf

from pipelines.acquisition.modbus.blocks import BlockReader
from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.modbus.wraparound import Unwrapper
from pipelines.acquisition.safety.watchdog import Watchdog
from pipelines.errors import DeviceError, Unanswered
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import SensorSettings


class Sensor:
    """One 3-axis force sensor."""

    def __init__(self, rig: RigSettings, settings: SensorSettings, line: Line) -> None:
        self.settings = settings
        self.map = rig.map.sensor[settings.map]
        self.device = Device(f"sensor {settings.cuff}", settings.unit, line, rig.safety)
        self.reader = BlockReader(self.device, self.map.read)
        self._turn = rig.turn_of(settings)
        self._watchdog = Watchdog(rig.safety.watchdog_s)
        self._in_lockstep, self._reply_s = rig.clock == "lockstep", rig.safety.longest_reply_s
        self._counter = Unwrapper(self.reader.block.modulus("sequence"))
        self._first: tuple[float, float] | None = None
        """Count of its first sample, and when it came, host's clock, s."""
        self._last: tuple[float, float] | None = None
        """The same of its newest sample."""
        self._awaits_late_reply = False
        """Whether a late answer may still come that would be taken for the next request's."""

    def is_due(self, cycle: int) -> bool:
        """Return whether the sensor is read in a cycle."""
        return cycle % self.settings.every == self._turn

    async def look(self) -> tuple[float, float, float] | None:
        """Read the force (N); None without a new sample, or without an answer for a short time.

        Raises
        ------
        DeviceError
            The sensor has not answered for too long, or its counter went back or leapt.
        """
        # The first call begins the wait, so that a sensor that never answers is noticed too.
        self._watchdog.waited(time.monotonic())
        try:
            values = self.reader.block.decode(await self.reader.read(in_motion=True))
        except Unanswered as error:
            if self._watchdog.has_expired(time.monotonic()):
                raise DeviceError(str(error)) from error
            self._awaits_late_reply = not self.device.line.has_transaction_ids
            return None
        now = time.monotonic()
        self._watchdog.reset(now)
        late_reply, self._awaits_late_reply = self._awaits_late_reply, False
        if late_reply or not self._goes_on(self._counter(values["sequence"]), now):
            return None
        return values["force_x"], values["force_y"], values["force_z"]

    def _goes_on(self, count: float, now: float) -> bool:
        """Return whether a sample is new; raise DeviceError if its counter went back or leapt."""
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
        """Return the most samples since the last new one that agree with the rate so far.

        Unlimited in lockstep, where no time passes, and until the rate is known.
        """
        # Time from which on the rate of a sensor's counter is known.
        settled_s = 0.5
        # Factor by which a counter may exceed its rate between two samples, and samples added to
        # that.
        leap = 2.0
        assert self._first and self._last  # this is not the first sample
        (first, since), (last, until) = self._first, self._last
        if self._in_lockstep or until - since < settled_s:
            return inf
        # How long each reply was under way is unknown, but it is at most `reply_s`.
        return leap * (1.0 + (last - first) / (until - since) * (now - until + self._reply_s))
