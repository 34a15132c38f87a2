"""How many samples a second the line carries: devices asked as in a run, nothing sent."""

import asyncio
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.latency import Latency
from pipelines.acquisition.check.probe import Probe

MOST_LATE = 0.05
"""Share of cycles that may take longer than a sample; a run would miss as many."""


@dataclass(frozen=True)
class Rate:
    """Cycles that were made, one after the other without a pause."""

    cycles_hz: float
    cycle: Latency
    late: float
    """Share of cycles longer than a sample; 0 where no rate is known."""


async def cycles(
    probes: Sequence[Probe], seconds: float, rate_hz: float | None, fewest: int = 20
) -> Rate:
    """Ask devices as a cycle of a run does, over and over; each probe keeps its answers.

    In real time nothing is written. In lockstep each cycle lets the drives go on by a sample, their
    torque away.

    Parameters
    ----------
    probes : sequence of Probe
        Drives first.
    seconds : float
        How long, but for ``fewest`` cycles at least.
    rate_hz : float, optional
        The rate that is wanted.
    """
    drives, sensors = [p for p in probes if p.is_drive], [p for p in probes if not p.is_drive]
    durations: list[float] = []
    began = time.perf_counter()
    while time.perf_counter() - began < seconds or len(durations) < fewest:
        start = time.perf_counter()
        due = [p.step() for p in sensors if p.is_due(len(durations))]
        if drives and drives[0].in_lockstep:
            await asyncio.gather(*due)
            await asyncio.gather(*(p.step() for p in drives))
        else:
            if drives:
                await drives[0].count()
            await asyncio.gather(*(p.step() for p in drives))
            await asyncio.gather(*due)
        durations.append(time.perf_counter() - start)
    took = np.array(durations)
    late = float(np.mean(took > 1.0 / rate_hz)) if rate_hz else 0.0
    return Rate(len(took) / float(took.sum()), Latency.of(took), late)


def check_rate(rate: Rate, drives: Rate, rate_hz: float) -> Iterator[Finding]:
    """Yield whether the line is too slow for the experiment, all devices asked or the drives
    alone."""
    if rate.cycles_hz >= rate_hz and rate.late <= MOST_LATE:
        return
    enough = drives.cycles_hz >= rate_hz and drives.late <= MOST_LATE
    remedy = (
        "raise `every` of the sensors"
        if enough
        else "lower acquire.sample_rate_hz, or use several lines"
    )
    yield Finding(
        "rig",
        f"all devices can be asked {rate.cycles_hz:.0f} times a second and {rate.late:.0%} of the"
        f" cycles take longer than a sample at {rate_hz:g} Hz; the drives alone reach"
        f" {drives.cycles_hz:.0f}: {remedy}",
    )
