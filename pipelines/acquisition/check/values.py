"""Whether the values of a machine that moves by itself are read as the device means them."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.misread import held, misread


def check_values(probe: Probe, series: Series, rate_hz: float | None) -> Iterator[Finding]:
    """Yield findings about values that are possible one by one, but not in a row.

    Parameters
    ----------
    probe : Probe
        A device that is only read.
    series : Series
        Repeated readings of its block.
    rate_hz : float, optional
        Rows a second of the experiment.
    """
    rows = _rows(series, rate_hz)
    for name, register in series.block.registers.items():
        if name in ("sequence", "time", "status"):
            continue
        values = series.of(name)
        where = f"{probe.map_path}.read.{name}"
        for text in misread(name, register, where, values[series.fresh]):
            yield Finding(probe.name, f"{name}: {text}", name, is_explained=True)
        if rows is not None and name in ("angle", "torque", "current"):
            for text in held(series.answered[rows], values[rows]):
                yield Finding(probe.name, f"{name}: {text}")


def _rows(series: Series, rate_hz: float | None) -> NDArray | None:
    """Return the readings that a recording would have as rows, (k,); None where that is unknown."""
    if "sequence" in series.block.names:
        return series.fresh
    if rate_hz is None:
        return None
    seconds = series.answered - series.answered[0]
    return np.unique(np.searchsorted(seconds, np.arange(0.0, seconds[-1], 1.0 / rate_hz)))
