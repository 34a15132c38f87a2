"""What a lab's recorder makes of a run: columns, stamps, lost samples, temperatures, and what the
file says."""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tests.campaigns.blind.conditions import Conditions
from tests.campaigns.blind.recorded import Recorded

Columns = dict[str, NDArray]
Gaps = list[tuple[float, int]]
SHORTEST_GAP, LONGEST_GAP = 4, 60
"""Samples that are lost at a time; fewer would be single samples that were dropped."""
TEMPERATURE_NOISE_C = 0.05


def stamped(columns: Columns, r: Recorded, conditions: Conditions, rng: Generator) -> Columns:
    """Return the columns that this recorder writes, stamped by its clock."""
    kept = {name: values for name, values in columns.items() if _is_written(name, conditions)}
    n = len(kept["time_s"])
    stray = conditions.jitter * conditions.sample_s * np.clip(rng.standard_normal(n), -3.0, 3.0)
    kept["time_s"] = kept["time_s"] * (1.0 + 1e-6 * conditions.clock_ppm) + stray
    kept["time_s"] -= min(0.0, kept["time_s"][0])
    if r.temperature is not None:
        step = rng.choice([0.01, 0.1, 0.5])
        for j, joint in enumerate(("hip", "knee")):
            measured = r.temperature[:, j] + rng.normal(0.0, TEMPERATURE_NOISE_C, n)
            kept[f"{joint}_temperature_c"] = step * np.round(measured / step)
    return kept


def _is_written(name: str, conditions: Conditions) -> bool:
    missing = {
        "_reference_rad": not conditions.has_reference,
        "_velocity_rad_s": not conditions.has_speed,
        "sequence": not conditions.has_counter,
    }
    return not any(name.endswith(end) and absent for end, absent in missing.items())


def with_gaps(columns: Columns, count: int, rng: Generator) -> tuple[Columns, Gaps]:
    """Lose samples in some places, and return what the file says of them."""
    n = len(columns["time_s"])
    lost = np.zeros(n, dtype=bool)
    starts = np.sort(
        rng.choice(np.arange(n // 10, n - n // 10, 2 * LONGEST_GAP), count, replace=False)
    )
    gaps = []
    for start in starts:
        length = int(rng.integers(SHORTEST_GAP, LONGEST_GAP))
        lost[start : start + length] = True
        gaps.append((float(columns["time_s"][start]), length))
    return {name: values[~lost] for name, values in columns.items()}, gaps


def header(
    metadata: dict[str, Any], conditions: Conditions, period_s: float | None
) -> dict[str, Any]:
    """Return what a file says, less what this recorder does not."""
    metadata = {"sample_rate_hz": conditions.rate_hz} | metadata
    if not conditions.has_controller:
        metadata.pop("controller", None)
    if not conditions.has_cuffs:
        geometry = {k: v for k, v in metadata["geometry"].items() if "cuff" not in k}
        metadata["geometry"] = geometry
    if conditions.says_period and period_s is not None:
        metadata["period_s"] = period_s
    return metadata
