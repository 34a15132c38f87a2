"""Find the unbroken stretches of a recording, and whether their samples are uniform."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipelines.contracts.windows import Window, windows
from pipelines.errors import InputError
from pipelines.signals.sampling import REACH, local_period, missing_samples

WINDOW = 2**16
"""Rows of a window of time stamps."""


@dataclass(frozen=True)
class Stretches:
    """All stretches of a recording in their order; every array is (s,)."""

    start: NDArray
    """Row of the first sample."""
    stop: NDArray
    """Row after the last sample."""
    origin_s: NDArray
    """Time of the first sample."""
    end_s: NDArray
    """Time of the last sample."""
    uniform: NDArray
    """True if every sample is on a grid of the nominal rate that begins with the first one."""
    slowest_hz: float
    """Rate of the slowest part that makes up a twentieth of the samples, if it changes much; else
    the nominal one."""
    uneven: bool
    """Whether steps vary so much that a mean over samples is no mean over time."""

    def __len__(self) -> int:
        """Return the number of stretches."""
        return len(self.start)

    @property
    def samples(self) -> NDArray:
        """Number of samples of each stretch, (s,)."""
        return self.stop - self.start

    def lasting(self, rate_hz: float) -> NDArray:
        """Return how many samples of a rate each stretch lasts, (s,)."""
        return np.rint((self.end_s - self.origin_s) * rate_hz).astype(np.int64) + 1

    @property
    def longest(self) -> int:
        """Index of the stretch that lasts longest, the first of equals."""
        return int(np.argmax(self.end_s - self.origin_s))


def find_stretches(times: Iterable[NDArray], rate_hz: float) -> Stretches:
    """Find the stretches of a recording whose times arrive piece by piece.

    Parameters
    ----------
    times : iterable of (n,) array
        Times in s, strictly increasing.
    rate_hz : float
        Nominal sample rate.

    Raises
    ------
    InputError
        If the times do not advance at about ``rate_hz``.
    """
    collector = _Collector(rate_hz)
    for window in windows((pa.table({"time_s": time}) for time in times), WINDOW, REACH):
        collector.add(window)
    return collector.stretches()


class _Collector:
    """The stretches of the windows so far."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._start: list[int] = []
        self._origin_s: list[float] = []
        self._end_s: list[float] = []
        self._off_grid_s: list[float] = []
        self._row, self._last_s = 0, 0.0
        self._periods: list[NDArray] = []
        # Time, number and number of uneven ones of the steps without missing samples.
        self._regular = np.zeros(3)

    def add(self, window: Window) -> None:
        """Add the core of a window; its margins show which steps are usual there."""
        # Length of a gap, s, that is bridged by interpolation. No leg moves noticeably in it, and a
        # bus that loses single samples would otherwise leave no stretch long enough to filter.
        bridged_s = 0.022
        time = window.rows["time_s"].to_numpy()
        if not self._start:
            self._begin(0, float(time[0]))
        core = np.arange(max(window.core.start, 1), window.core.stop)
        steps, missing = np.diff(time), missing_samples(time)
        cuts = core[(missing[core - 1] > 0) & (steps[core - 1] > bridged_s)]
        for first, last in pairwise([window.core.start, *cuts.tolist(), window.core.stop]):
            if first in cuts:
                self._end_s.append(float(time[first - 1]))
                self._begin(window.first + first, float(time[first]))
            self._compare(window.first + first, time[first:last])
        self._count(steps, missing, local_period(time), core - 1, window.first)
        self._row, self._last_s = window.first + window.core.stop, float(time[window.core.stop - 1])

    def _begin(self, row: int, time_s: float) -> None:
        self._start.append(row)
        self._origin_s.append(time_s)
        self._off_grid_s.append(0.0)

    def _compare(self, row: int, time: NDArray) -> None:
        """Compare samples (n,) from a row on with the grid of their stretch."""
        # Each stretch has its own grid, so that the length of a gap does not matter.
        number = row + np.arange(len(time)) - self._start[-1]
        away = np.abs(time - self._origin_s[-1] - number / self._rate_hz)
        self._off_grid_s[-1] = max(self._off_grid_s[-1], float(away.max(initial=0.0)))

    def _count(
        self, steps: NDArray, missing: NDArray, period: NDArray, core: NDArray, first: int
    ) -> None:
        """Count the steps of a window's core, by their indices; the first row's number is given."""
        core = core[missing[core] == 0]
        uneven = np.abs(steps[core] - period[core]) > 0.02 * period[core]
        self._regular += steps[core].sum(), len(core), uneven.sum()
        # Some of the local periods, by their row, so that windows make no difference.
        self._periods.append(period[core][(first + core) % 64 == 0])

    def stretches(self) -> Stretches:
        """Return the result; raise InputError where the rate is another one."""
        # Share of uneven steps, or of the rate that the slowest part has, from which fits average
        # over time.
        most_uneven, much_slower = 0.05, 0.9
        lasts, count, uneven = self._regular
        periods = np.concatenate([*self._periods, np.zeros(0)])
        # A single sample has no step.
        rate_hz = count / lasts if count else self._rate_hz
        self._refuse_another(rate_hz)
        slowest_hz = 1.0 / float(np.quantile(periods, 0.95)) if len(periods) else rate_hz
        changes = slowest_hz < much_slower * rate_hz
        return Stretches(
            start=np.array(self._start, dtype=np.int64),
            stop=np.array([*self._start[1:], self._row], dtype=np.int64),
            origin_s=np.array(self._origin_s),
            end_s=np.array([*self._end_s, self._last_s]),
            # Samples farther from the uniform grid are interpolated.
            uniform=np.array(self._off_grid_s) < 0.02 / self._rate_hz,
            slowest_hz=slowest_hz if changes else self._rate_hz,
            uneven=changes or bool(uneven > most_uneven * count),
        )

    def _refuse_another(self, rate_hz: float) -> None:
        # Within a factor of two it may be jitter; beyond it, a rate or a unit of time is wrong.
        if not 0.5 < rate_hz / self._rate_hz < 2.0:
            raise InputError(
                f"metadata sample_rate_hz is {self._rate_hz:g}, but time_s advances by"
                f" {1.0 / rate_hz:g} s ({rate_hz:g} Hz); correct the one that is wrong"
            )


def edge(rate_hz: float, cutoff_hz: float) -> int:
    """Return the length of a stretch's ends, where the filter lacks one side.

    Parameters
    ----------
    rate_hz, cutoff_hz : float
        Sample rate and cut-off, Hz.

    Returns
    -------
    int
        Samples at each end.
    """
    # Periods of the cut-off at each end of a stretch where the filter lacks one side.
    edge_periods = 1.5
    return int(np.ceil(edge_periods * rate_hz / cutoff_hz))
