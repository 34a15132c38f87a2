import asyncio
import sys
import time

import pytest

from pipelines.process.event_loop import exact_event_loop


@pytest.mark.skipif(sys.platform == "win32", reason="the usual loop is used there")
def test_a_sleeper_is_woken_within_a_fraction_of_a_millisecond_of_when_it_is_due():
    async def late():
        began = time.perf_counter()
        await asyncio.sleep(0.0004)
        return time.perf_counter() - began - 0.0004

    async def least():
        return min([await late() for _ in range(50)])

    with asyncio.Runner(loop_factory=exact_event_loop) as runner:
        assert runner.run(least()) < 0.0004
