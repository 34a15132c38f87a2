"""When to exchange: at once in lockstep; in step with the devices' own clock in real time."""

import asyncio
import time
from collections.abc import Awaitable, Callable

LEAN = 0.005
"""Share of a sample period by which each look at the counter comes earlier than the last."""
SLOW = 0.3
"""Share of a sample period after which an answer is too old where the next sample is unknown."""


class Lockstep:
    """The devices wait for the exchange."""

    def __init__(self, counter: Callable[[], Awaitable[int]]) -> None:
        self._counter = counter
        self._asked: int | None = None

    async def wait(self, last: int) -> int:
        """Return at once; the exchange after that of sample ``last`` finds the next one.

        Where that exchange has brought nothing, it is looked up which one is next: the answer may
        have been lost, or the request.
        """
        again, self._asked = last == self._asked, last
        return max(last + 1, await self._counter()) if again else last + 1


class PhaseLock:
    """The host's clock locked to the devices' samples, of which only the counter is seen.

    Each look at the counter leans a little towards the instant at which a sample is latched, and
    steps back when it came too early. So the exchange that follows has nearly the whole sample to
    be made in, whichever of the two clocks runs faster; and it is known which sample it finds, so
    that each set-point comes at its time.
    """

    def __init__(
        self, sample_rate_hz: float, counter: Callable[[], Awaitable[int]], patience_s: float
    ) -> None:
        self._period = 1.0 / sample_rate_hz
        self._counter = counter
        self._patience_s = patience_s
        self._due = time.perf_counter()
        self._count: int | None = None
        self._early: tuple[float, int] | None = None
        """When a look came too early, and the sample it returned: the next was latched later."""

    async def wait(self, last: int) -> int:
        """Wait for a sample after ``last`` that was not awaited yet; return its number.

        Return ``last`` if none is latched in time. A sample that was awaited and that no exchange
        read is not awaited again: its time has passed.
        """
        # Share of a sample period to wait after a look that came too early.
        step_back = 0.1
        began = time.perf_counter()
        looked = last if self._count is None else self._count
        before = max(last, looked)  # an exchange may have found a later one than the look before it
        while True:
            await asyncio.sleep(max(0.0, self._due - time.perf_counter()))
            asked = time.perf_counter()
            count, now = await self._counter(), time.perf_counter()
            if now > self._fresh_until(count, asked) and now - began < self._patience_s:
                continue  # by now another sample may be latched
            if count != before:
                # As many periods later as samples were found, and a little earlier, towards the
                # latch.
                self._due += (count - looked - LEAN) * self._period
                self._count = count
                return count
            if now - began > self._patience_s:
                return last
            self._early, looked = (asked, count), count
            self._due = now + step_back * self._period

    def _fresh_until(self, count: int, asked: float) -> float:
        """Return until when a sample that a look found is surely the newest, host's clock, s;
        ``asked`` is the look's.

        Samples follow one another in equal periods since the last look that came too early.
        """
        soon = asked + SLOW * self._period
        since, then = self._early or (asked, count)
        # Looks come too early every so often; where none has for long, the clocks are further apart
        # than they lean.
        if not 0 <= count - then <= 0.5 / LEAN:
            return soon
        return max(soon, since + (count - then) * (1.0 - LEAN) * self._period)
