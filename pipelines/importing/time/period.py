"""Find the period of a motion, by which noise is separated from systematic errors."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.signal import argrelmin, correlate

from pipelines.importing.quantities.consistency import whole_rows
from pipelines.signals.sampling import whole_periods

SIMILAR = 0.5
"""Half mean squared difference, in variances, below which a motion may repeat."""

REPEATS = 5e-4
"""Difference of the median pair of neighbouring periods of a periodic motion: 3 % in rms.

Drives repeat their errors, too. A machine that swings freely does not repeat so well.
"""


def repeats_after(time_s: NDArray, motion: NDArray) -> float | None:
    """Return the period of a motion.

    Parameters
    ----------
    time_s : (n,) array
        Times, s.
    motion : (n, k) array
        Angles or set-points of k joints, in any units, NaN where missing.

    Returns
    -------
    float or None
        Period, s. None if the run is shorter than two periods, or its periods differ by more than a
        drive's errors.
    """
    on_grid = _on_grid(time_s, motion)
    best = None if on_grid is None else _best_period(*on_grid)
    return None if best is None else best[0]


def better_period(time_s: NDArray, motion: NDArray, period_s: float) -> float | None:
    """Return the period of a motion that does not repeat after the one that is given.

    Parameters
    ----------
    time_s : (n,) array
        Times, s.
    motion : (n, k) array
        Angles or set-points of k joints, in any units, NaN where missing.
    period_s : float
        Period that is given, s; multiples of the shortest one are right, too.

    Returns
    -------
    float or None
        Period, s. None if the motion repeats after the given one, if it is shorter than two of
        these, or if it has no period.
    """
    # Factor by which the given period must fit worse.
    much_worse = 20.0
    # Share of a period within which it is a multiple of another: a ramp at an end of a few periods
    # makes their difference large, with the right one, too.
    same = 5e-3
    on_grid = _on_grid(time_s, motion)
    if on_grid is None:
        return None
    step, columns = on_grid
    if whole_periods(len(columns) - 1, 1.0, period_s / step) < 2:
        return None
    given = _median_difference(columns, period_s / step)
    if given <= REPEATS:
        return None
    best = _best_period(step, columns)
    if best is None or given < much_worse * best[1]:
        return None
    best_s = best[0]
    is_multiple = abs(period_s - best_s * round(period_s / best_s)) <= same * period_s
    return None if is_multiple else best_s


def _on_grid(time_s: NDArray, motion: NDArray) -> tuple[float, NDArray] | None:
    """Return a uniform step, s, and the joints that move at its instants, scaled to variance 1.

    None where none moves, or rows are too few.
    """
    # Greatest number of instants that are compared.
    points = 20_000
    moving = [
        column
        for column in motion.T
        if np.isfinite(column).any() and np.nanmax(column) > np.nanmin(column)
    ]
    if not moving:
        return None
    # Rows without gaps in any joint, then a uniform grid, as the correlation needs one.
    time_s, *moving = whole_rows(time_s, *moving)
    if len(time_s) < 40:
        return None
    step = max(float(np.median(np.diff(time_s))), (time_s[-1] - time_s[0]) / points)
    grid = np.arange(time_s[0], time_s[-1] + 0.5 * step, step)
    columns = np.column_stack([np.interp(grid, time_s, column) for column in moving])
    return step, (columns - columns.mean(axis=0)) / np.maximum(columns.std(axis=0), 1e-300)


def _best_period(step: float, columns: NDArray) -> tuple[float, float] | None:
    """Return the period of joints (n, k) on a grid of a step, s, and its periods' difference."""
    # Factor on the least difference up to which a shorter lag is preferred.
    as_good = 3.0
    # The same for a lag of fewer digits.
    as_round = 1.1
    # Difference due to a sensor's resolution and interpolation alone.
    equal = 1e-8
    difference_at = partial(_median_difference, columns)
    near = [
        _refined(difference_at, lag)
        for lag in _candidates(_mean_differences(columns))
        if difference_at(lag) < SIMILAR
    ]
    best = min((difference for _, difference in near), default=np.inf)
    if best > REPEATS:
        return None
    # The shortest that is nearly as good, because every multiple of a period repeats, too.
    lag, least = min(
        (lag, difference) for lag, difference in near if difference <= max(as_good * best, equal)
    )
    # Periods are planned as round numbers; noise moves only the last digits.
    rounder = (float(f"{step * lag:.{digits}g}") for digits in range(1, 7))
    limit = max(as_round * least, equal)
    near_enough = (period_s for period_s in rounder if difference_at(period_s / step) < limit)
    return next(near_enough, float(f"{step * lag:.6g}")), least


def _mean_differences(columns: NDArray) -> NDArray:
    """Return half the mean squared difference at each lag up to half the run, of the worst joint.

    The motion of k joints, (n, k), has variance 1; so has the unit of the result, a value for each
    lag.
    """
    n = len(columns)
    # The second of two periods may lack a sample.
    lags = np.arange((n + 1) // 2 + 1)
    worst = np.zeros(len(lags))
    for column in columns.T:
        # The square of a difference is two energies less twice the correlation. By FFT and
        # cumulative sums all lags cost n log n instead of n².
        together = correlate(column, column, method="fft")[n - 1 : n + len(lags) - 1]
        power = np.concatenate([[0.0], np.cumsum(column**2)])
        both = power[n - lags] + power[n] - power[lags]
        worst = np.maximum(worst, 0.5 * (both - 2.0 * together) / (n - lags))
    return worst


def _candidates(differences: NDArray) -> list[float]:
    """Return the lags of minima below SIMILAR after the first lag above it, the best first."""
    # Greatest number of lags that are refined.
    most_lags = 100
    # A smooth motion resembles itself at short lags, without any period.
    different = np.flatnonzero(differences > SIMILAR)
    if not len(different):
        return []
    # Infinity after the last lag, so that a period of half the run can be a minimum.
    (lags,) = argrelmin(np.append(differences, np.inf))
    lags = lags[(lags > different[0]) & (differences[lags] < SIMILAR)]
    return [float(lag) for lag in lags[np.argsort(differences[lags])[:most_lags]]]


def _median_difference(columns: NDArray, lag: float) -> float:
    """Return the difference of neighbouring periods without their means, the median of all pairs.

    Periods are cut from the middle of the run, as ramps are at its ends. The median is robust
    against a ramp or a fault in some of them. The lag is the length of a period in samples; values
    between samples are interpolated.
    """
    # Share of the variance below which a period has too little motion to be compared.
    at_rest = 0.01
    n, length = len(columns), int(lag)
    count = whole_periods(n - 1, 1.0, lag)
    begins = 0.5 * (n - count * lag) + lag * np.arange(count)
    at = begins[:, np.newaxis] + np.arange(length)
    periods = np.stack([np.interp(at, np.arange(n), column) for column in columns.T], axis=-1)
    moving = [period for period in periods if (period.var(axis=0) > at_rest).all()]
    pairs = sorted(
        float(np.max((b - a).var(axis=0) / (a.var(axis=0) + b.var(axis=0))))
        for a, b in pairwise(moving)
    )
    return pairs[(len(pairs) - 1) // 2] if pairs else 1.0


def _refined(difference: Callable[[float], float], lag: float) -> tuple[float, float]:
    """Return the lag near a whole one, between samples, of least difference, and the difference."""
    # Share of a lag by which a ramp or drift may shift it.
    smeared = 0.01
    bounds = (1.0 - smeared) * lag - 1.0, (1.0 + smeared) * lag + 1.0
    best = minimize_scalar(difference, bounds=bounds, method="bounded", options={"xatol": 0.02})
    return float(best.x), float(best.fun)
