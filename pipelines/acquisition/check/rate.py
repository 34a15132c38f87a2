"""The highest rate of cycles, measured by reading all devices as in a run."""

import asyncio
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.latency import Latency
from pipelines.acquisition.check.probe import Probe


@dataclass(frozen=True)
class Rate:
    """Statistics of cycles without pauses."""

    cycles_hz: float
    late: float
    """Share of cycles that are longer than a sample; 0 where no rate is known."""
    cycle: Latency


async def cycles(probes: Sequence[Probe], seconds: float, rate_hz: float | None) -> Rate:
    """Read devices in cycles as in a run; each probe keeps its answers.

    In real time nothing is written. In lockstep each cycle advances the disabled drives by a
    sample.

    Parameters
    ----------
    probes : sequence of Probe
        Drives first.
    seconds : float
        Duration, unless the fewest cycles take longer.
    rate_hz : float, optional
        The rate of the experiment.
    """
    fewest = 20
    drives, sensors = [p for p in probes if p.is_drive], [p for p in probes if not p.is_drive]
    durations: list[float] = []
    began = time.perf_counter()
    while time.perf_counter() - began < seconds or len(durations) < fewest:
        start = time.perf_counter()
        due = [p.step() for p in sensors if p.is_due(len(durations))]
        # As in `Machine.cycle`: in lockstep the exchange with the drives ends the sample.
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
    return Rate(len(took) / float(took.sum()), late, Latency.of(took))


def check_rate(rate: Rate, drives: Rate, rate_hz: float) -> Iterator[Finding]:
    """Yield a finding where the lines are too slow for the experiment's rate.

    Parameters
    ----------
    rate, drives : Rate
        Measured with all devices, and with drives alone.
    rate_hz : float
        The experiment's sample rate, Hz.

    Yields
    ------
    Finding
        At most one, with a remedy.
    """
    # Largest allowed share of cycles that take longer than a sample: a run misses those.
    most_late = 0.05
    if rate.cycles_hz >= rate_hz and rate.late <= most_late:
        return
    enough = drives.cycles_hz >= rate_hz and drives.late <= most_late
    remedy = "lower acquire.sample_rate_hz, or use several lines"
    if enough:
        remedy = "raise `every` of the sensors"
    yield Finding(
        "rig",
        f"all devices can be asked {rate.cycles_hz:.0f} times a second (drives:"
        f" {drives.cycles_hz:.0f}), {rate.late:.0%} of the cycles are too long at {rate_hz:g} Hz;"
        f" {remedy}",
    )
