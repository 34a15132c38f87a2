"""After how long a motion repeats: what differs between periods is noise, and what does not may be
a cause."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.signal import argrelmin, correlate

from pipelines.importing.quantities.consistency import whole_rows

POINTS = 20_000
"""Instants that are looked at at most."""
ANOTHER, MAYBE_ALIKE = 0.5, 0.5
"""Half mean squared difference, in variances, above which a motion has become another, and below
which it may be the same again."""
REPEATS = 5e-4
"""The same, of a usual pair of neighbouring periods, up to which a motion is repeated: 3 % in rms,
for drives repeat their errors too, and a machine that swings by itself does not do so well."""
AS_GOOD, AS_ROUND = 3.0, 1.1
"""So often the least difference a shorter lag may leave that is preferred to the best, and a
rounder one."""
EQUAL = 1e-8
"""A difference that is none: a sensor's steps and interpolation leave as much."""
AT_REST = 0.01
"""Share of the variance below which a stretch moves too little to repeat anything."""
MOST_LAGS = 100
SMEARED = 0.01
"""Share of a lag by which a ramp or drift may shift it."""


def repeats_after(time_s: NDArray, motion: NDArray) -> float | None:
    """Return the period, s, of a motion (n, k) of k joints, in any units, at times (n,) s; None
    where none repeats.

    A run shorter than two periods shows none, and neither does one whose periods differ by more
    than a drive's errors.
    """
    moving = [
        column
        for column in motion.T
        if np.isfinite(column).any() and np.nanmax(column) > np.nanmin(column)
    ]
    if not moving:
        return None
    time_s, *moving = whole_rows(time_s, *moving)
    if len(time_s) < 40:
        return None
    step = max(float(np.median(np.diff(time_s))), (time_s[-1] - time_s[0]) / POINTS)
    grid = np.arange(time_s[0], time_s[-1] + 0.5 * step, step)
    columns = np.column_stack([np.interp(grid, time_s, column) for column in moving])
    columns = (columns - columns.mean(axis=0)) / np.maximum(columns.std(axis=0), 1e-300)

    def unlike(lag: float) -> float:
        return _of_a_usual_pair(columns, lag)

    near = [
        _least(unlike, lag)
        for lag in _candidates(_difference(columns))
        if unlike(lag) < MAYBE_ALIKE
    ]
    best = min((difference for _, difference in near), default=np.inf)
    if best > REPEATS:
        return None
    lag, least = min(
        (lag, difference) for lag, difference in near if difference <= max(AS_GOOD * best, EQUAL)
    )
    rounder = (float(f"{step * lag:.{digits}g}") for digits in range(1, 7))
    as_good = (one for one in rounder if unlike(one / step) < max(AS_ROUND * least, EQUAL))
    return next(as_good, float(f"{step * lag:.6g}"))


def _difference(columns: NDArray) -> NDArray:
    """Return half the mean squared difference after each lag up to half the run, of the joint that
    differs most."""
    n = len(columns)
    lags = np.arange(n // 2 + 1)
    found = np.zeros(len(lags))
    for column in columns.T:
        together = correlate(column, column, method="fft")[n - 1 : n + len(lags) - 1]
        power = np.concatenate([[0.0], np.cumsum(column**2)])
        both = power[n - lags] + power[n] - power[lags]
        found = np.maximum(found, 0.5 * (both - 2.0 * together) / (n - lags))
    return found


def _candidates(unlike: NDArray) -> list[float]:
    """Return the lags after which a motion, once another one, is like itself again, the likest of
    them."""
    another = np.flatnonzero(unlike > ANOTHER)
    if not len(another):
        return []
    (lags,) = argrelmin(np.append(unlike, np.inf))
    lags = lags[(lags > another[0]) & (unlike[lags] < MAYBE_ALIKE)]
    return [float(lag) for lag in lags[np.argsort(unlike[lags])[:MOST_LAGS]]]


def _of_a_usual_pair(columns: NDArray, lag: float) -> float:
    """Return how neighbouring periods differ but for a drift: the usual pair, for a ramp or a fault
    spoils some.

    They are cut from the middle of the run, for ramps are at its ends; a lag between samples is
    interpolated to.
    """
    n, length = len(columns), int(lag)
    count = int(n / lag + 1e-6)
    begins = 0.5 * (n - count * lag) + lag * np.arange(count)
    at = begins[:, np.newaxis] + np.arange(length)
    periods = np.stack([np.interp(at, np.arange(n), column) for column in columns.T], axis=-1)
    moving = [period for period in periods if (period.var(axis=0) > AT_REST).all()]
    pairs = sorted(
        float(np.max((b - a).var(axis=0) / (a.var(axis=0) + b.var(axis=0))))
        for a, b in pairwise(moving)
    )
    return pairs[(len(pairs) - 1) // 2] if pairs else 1.0


def _least(difference: Callable[[float], float], lag: float) -> tuple[float, float]:
    """Return the lag near one, and between samples, that leaves least difference, and that
    difference."""
    bounds = (1.0 - SMEARED) * lag - 1.0, (1.0 + SMEARED) * lag + 1.0
    best = minimize_scalar(difference, bounds=bounds, method="bounded", options={"xatol": 0.02})
    return float(best.x), float(best.fun)
