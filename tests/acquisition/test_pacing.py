import asyncio

import numpy as np
import pytest

from pipelines.acquisition import pacing
from pipelines.acquisition.pacing import PhaseLock

PERIOD = 0.005


class Clock:
    """The host's clock: it moves only where something waits."""

    def __init__(self):
        self.now = 100.0

    def perf_counter(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()

    async def sleep(seconds):
        clock.now += seconds + 0.0007  # a system wakes its sleepers late

    monkeypatch.setattr(pacing, "time", clock)
    monkeypatch.setattr(pacing.asyncio, "sleep", sleep)
    return clock


@pytest.mark.parametrize("drift", [-1e-3, 0.0, 1e-3])
def test_no_sample_is_missed_and_each_is_found_early_whichever_clock_runs_faster(clock, drift):
    def sample():
        return (clock.now - 100.0) * (1 + drift) / PERIOD

    async def counter():
        clock.now += 0.0003  # a short request
        return int(sample())

    async def run():
        lock, seen, phases = PhaseLock(1 / PERIOD, counter, 1.0), [0], []
        while clock.now < 160.0:
            seen.append(await lock.wait(seen[-1]))
            clock.now += 0.0006  # an exchange
            phases.append(sample() - seen[-1])
        return seen, phases

    seen, phases = asyncio.run(run())
    assert seen == list(range(len(seen)))
    assert len(seen) > 11_900
    assert max(phases) < 0.6  # so the exchange could have been 2 ms late


def test_after_a_busy_moment_it_is_known_which_sample_the_exchange_finds(clock):
    async def counter():
        return int((clock.now - 100.0) / PERIOD)

    async def run():
        lock = PhaseLock(1 / PERIOD, counter, 1.0)
        first = await lock.wait(0)
        clock.now += 3 * PERIOD
        return first, await lock.wait(first)

    first, second = asyncio.run(run())
    assert second - first >= 3
    assert second == int((clock.now - 100.0) / PERIOD)


def steps_about(clock, took_s, brought):
    """Steps from sample to sample found in 100 cycles, where the exchange of cycle 50 takes so
    long.

    ``brought`` returns the sample that it brings, of the one before it and the one that was found.
    """

    async def counter():
        clock.now += 0.0003
        return int((clock.now - 100.0) / PERIOD)

    async def run():
        lock, last, found = PhaseLock(1 / PERIOD, counter, 1.0), 0, []
        for cycle in range(100):
            found.append(await lock.wait(last))
            clock.now += took_s if cycle == 50 else 0.0006
            last = brought(last, found[-1]) if cycle == 50 else found[-1]
        return found

    return np.diff(asyncio.run(run()))


def test_after_an_exchange_that_was_not_answered_no_sample_is_missed_but_its_own(clock):
    steps = steps_about(clock, 3.6 * PERIOD, lambda last, found: last)
    assert steps[50] > 1
    assert set(np.delete(steps, 50)) == {1}


def test_what_an_exchange_found_is_not_waited_for_again(clock):
    """After a silence the drives are asked, and a sample may have gone by meanwhile."""
    steps = steps_about(clock, PERIOD + 0.0006, lambda last, found: found + 1)
    assert steps[50] == 2
    assert set(np.delete(steps, 50)) == {1}


def test_a_counter_that_stands_still_is_not_waited_for_for_ever(clock):
    async def counter():
        return 7

    assert asyncio.run(PhaseLock(1 / PERIOD, counter, 1.0).wait(7)) == 7
    assert clock.now < 101.1


def test_an_answer_that_took_half_a_sample_is_built_on_once_it_is_known_when_samples_come(clock):
    took, looks = [0.0003], []

    async def counter():
        looks.append(clock.now)
        found = int((clock.now - 100.0) / PERIOD)
        clock.now += took[0]
        return found

    async def run():
        lock, last = PhaseLock(1 / PERIOD, counter, 1.0), 0
        for _ in range(60):
            last = await lock.wait(last)
            clock.now += 0.0006
        took[0] = 0.5 * PERIOD
        looks.clear()
        return last, await lock.wait(last)

    last, found = asyncio.run(run())
    assert found == last + 1
    assert len(looks) == 1
