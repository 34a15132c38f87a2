"""When to exchange: at once in lockstep; in step with the devices' own clock in real time."""

import asyncio
import time

LEAN = 0.005
"""Share of a sample period by which each exchange comes earlier than one period after the last."""
STEP_BACK = 0.25
"""Share of a sample period to wait after an exchange came too early."""


class Lockstep:
    """The devices wait for the exchange."""

    async def wait(self) -> None:
        """Return at once."""

    def fresh(self, samples: int) -> None:
        """Note that the exchange brought a new sample."""

    def stale(self) -> None:
        """Note that it brought the last one again."""


class PhaseLock:
    """The host's clock locked to the devices' samples, of which only the counter is seen.

    Each exchange leans a little towards the instant at which the sample is latched. When one comes too early
    (the counter has not moved) the phase steps back. So exchanges stay in the first part of each sample, as
    far as possible from missing it, whichever of the two clocks runs faster.
    """

    def __init__(self, sample_rate_hz: float) -> None:
        self._period = 1.0 / sample_rate_hz
        self._due = time.perf_counter()

    async def wait(self) -> None:
        """Wait until the next sample should have been latched."""
        await asyncio.sleep(max(0.0, self._due - time.perf_counter()))

    def fresh(self, samples: int) -> None:
        """Note that the exchange brought a new sample, ``samples`` after the last one."""
        self._due += (samples - LEAN) * self._period

    def stale(self) -> None:
        """Note that it brought the last one again."""
        self._due = max(self._due, time.perf_counter()) + STEP_BACK * self._period
