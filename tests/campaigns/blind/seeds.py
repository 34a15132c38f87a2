"""Which seeds are for what; the ranges never meet."""

from collections.abc import Iterable

RANGES = {
    "tuning": range(100_000, 540_000),
    "reporting": range(540_000, 900_000),
    "fixed": range(900_000, 1_000_000),
}
"""For whoever works on the diagnosis; for numbers that are published; for the fixed set and the
simulator's tests."""


def uses(seeds: Iterable[int]) -> set[str]:
    """Return what seeds are for."""
    return {next((use for use, seeds in RANGES.items() if seed in seeds), "none") for seed in seeds}
