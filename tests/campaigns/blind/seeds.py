"""Which seeds are for what; the ranges never meet."""

from collections.abc import Iterable

RANGES = {
    "tuning": range(100_000, 540_000),
    "reporting": range(540_000, 900_000),
    "fixed": range(900_000, 1_000_000),
}
"""For whoever works on the diagnosis; for numbers that are published; for the fixed set and the
simulator's tests."""


READ_ONE_BY_ONE = range(840_000, 840_360)
"""Seeds that were reported once, and whose cases were then read one by one: for tuning since."""


def uses(seeds: Iterable[int]) -> set[str]:
    """Return what seeds are for."""
    return {_use(seed) for seed in seeds}


def _use(seed: int) -> str:
    if seed in READ_ONE_BY_ONE:
        return "tuning"
    return next((use for use, seeds in RANGES.items() if seed in seeds), "none")
