"""Whether the values of a machine that moves by itself are read as the device means them."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.misread import held, misread
from pipelines.signals.held import new_values


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
            # Late readings miss samples of a device that counts them, and repeat none.
            is_counted = "sequence" in series.block.names
            if not is_counted and not _is_renewed_slower(series, values, rows):
                continue
            for text in held(series.answered[rows], values[rows]):
                yield Finding(probe.name, f"{name}: {text}")


def _is_renewed_slower(series: Series, values: NDArray, rows: NDArray) -> bool:
    """Return whether all readings, too, have new values less often than there are rows.

    A row that is read late has the next sample's value, and then it comes in two rows.
    """
    # Least ratio of both periods: each is a median of instants that jitter.
    slower = 1.05
    new = new_values(values)
    if min(len(new), len(rows)) < 2:
        return False
    new_s, row_s = (float(np.median(np.diff(series.answered[some]))) for some in (new, rows))
    return new_s > slower * row_s


def _rows(series: Series, rate_hz: float | None) -> NDArray | None:
    """Return the readings that a recording would have as rows, (k,); None where that is unknown."""
    if "sequence" in series.block.names:
        return series.fresh
    if rate_hz is None:
        return None
    seconds = series.answered - series.answered[0]
    return np.unique(np.searchsorted(seconds, np.arange(0.0, seconds[-1], 1.0 / rate_hz)))
