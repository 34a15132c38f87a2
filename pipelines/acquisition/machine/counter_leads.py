"""How far the sample counters of drives are ahead of the first drive's, while they go on."""

import asyncio
from collections.abc import Sequence

from pipelines.acquisition.machine.clock_offset import Bounds
from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.machine.reading import Reading


async def find_leads(drives: Sequence[Drive], rate_hz: float) -> list[int | None]:
    """Return the samples by which each drive is ahead of the first.

    Each reply bounds a lead. Where the drives' clocks give a lead within these bounds, they show
    the same time, and it is that one; else the bounds must leave a single whole number.

    Parameters
    ----------
    drives : sequence of Drive
        At least one.
    rate_hz : float
        Sample rate, Hz.

    Returns
    -------
    list
        Samples, 0 for the first; None where a lead is unclear.
    """
    # Most readings of each drive.
    most_looks = 200
    all_bounds = [Bounds(1.0 / rate_hz) for _ in drives]
    for drive, bounds in zip(drives, all_bounds, strict=True):
        drive.bounds = bounds
    leads: list[int | None] = []
    try:
        for _ in range(most_looks):
            readings = await asyncio.gather(*(drive.look() for drive in drives))
            leads = [
                _lead(all_bounds[0], bounds, readings[0], reading, rate_hz)
                for bounds, reading in zip(all_bounds[1:], readings[1:], strict=True)
            ]
            if None not in leads:
                break
    finally:
        for drive in drives:
            drive.bounds = None
    return [0, *leads]


def _lead(
    first_bounds: Bounds, bounds: Bounds, first: Reading, other: Reading, rate_hz: float
) -> int | None:
    # Largest difference, in samples, between clocks that count as showing the same time.
    same_time = 0.1
    (first_origin, first_width), (origin, width) = first_bounds.now(), bounds.now()
    # At one instant t the drives have the numbers (t - origin) / period. Each origin is known to
    # half the width of its bounds.
    bounded = (first_origin - origin) * rate_hz
    margin = (first_width + width) * rate_hz / 2
    by_clock = other.sequence - first.sequence - (other.time - first.time) * rate_hz
    nearest = round(by_clock)
    if abs(by_clock - nearest) < same_time and abs(nearest - bounded) <= margin + 0.5:
        return nearest
    # Drives with a common clock differ by a whole number, of which a wider range may hold two.
    return round(bounded) if margin <= 0.5 else None
