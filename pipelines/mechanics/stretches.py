"""Find the unbroken stretches of a recording, and whether their samples are uniform."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import InputError


@dataclass(frozen=True)
class Stretches:
    """All stretches of a recording in their order; every array is (s,)."""

    start: NDArray
    """Row of the first sample."""
    stop: NDArray
    """Row after the last sample."""
    origin_s: NDArray
    """Time of the first sample."""
    uniform: NDArray
    """True if every sample is on a grid of the nominal rate that begins with the first one."""

    def __len__(self) -> int:
        """Return the number of stretches."""
        return len(self.start)

    @property
    def samples(self) -> NDArray:
        """Number of samples of each stretch, (s,)."""
        return self.stop - self.start

    @property
    def longest(self) -> int:
        """Index of the longest stretch, the first of equals."""
        return int(np.argmax(self.samples))


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
    # Sample periods between two samples that make a gap, unless it is bridged.
    gap = 1.5
    # Length of a gap that is bridged by interpolation. No leg moves noticeably in it, and a bus
    # that loses single samples, or a clock that is late once, would otherwise leave no stretch long
    # enough for the filter.
    bridged_s = 0.022
    starts: list[int] = []
    origins: list[float] = []
    strayed: list[float] = []
    steps: list[float] = []
    # The infinite first step makes the first sample begin a stretch.
    row, start, origin, stray, before = 0, 0, np.nan, 0.0, -np.inf
    for time in times:
        step = np.diff(time, prepend=before)
        # A median does not notice gaps and lost samples, which are few.
        steps += [float(np.median(step[np.isfinite(step)]))] if np.isfinite(step).any() else []
        begins = np.flatnonzero(step > max(gap / rate_hz, bridged_s))
        # The first entry continues the stretch of the piece before, even without rows here.
        start_of, origin_of = np.append(start, row + begins), np.append(origin, time[begins])
        # Stretch of each sample; 0 is the one that an earlier piece began.
        number = np.searchsorted(begins, np.arange(len(time)), "right")
        # Each stretch has its own grid, so that the length of a gap does not matter.
        grid = origin_of[number] + (row + np.arange(len(time)) - start_of[number]) / rate_hz
        away = np.append(stray, np.zeros(len(begins)))
        np.maximum.at(away, number, np.abs(time - grid))
        starts.extend(start_of[1:])
        origins.extend(origin_of[1:])
        strayed.extend(away[:-1])
        row, before = row + len(time), time[-1]
        start, origin, stray = start_of[-1], origin_of[-1], away[-1]
    _refuse_another_rate(steps, rate_hz)
    return Stretches(
        start=np.array(starts, dtype=np.int64),
        stop=np.array([*starts[1:], row], dtype=np.int64),
        origin_s=np.array(origins),
        # The first entry precedes the first row, and is empty. Samples farther from the uniform
        # grid are interpolated.
        uniform=np.array([*strayed[1:], stray]) < 0.02 / rate_hz,
    )


def _refuse_another_rate(steps: list[float], rate_hz: float) -> None:
    step = float(np.median(steps)) if steps else 1.0 / rate_hz
    # Within a factor of two it may be jitter; beyond it, a rate or a unit of time is wrong.
    if not 0.5 < 1.0 / (step * rate_hz) < 2.0:
        raise InputError(
            f"metadata sample_rate_hz is {rate_hz:g}, but time_s advances by {step:g} s "
            f"({1.0 / step:g} Hz); correct the one that is wrong"
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
