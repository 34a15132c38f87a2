"""Estimate the noise floor from the residual that does not repeat between periods."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.signals.sampling import whole_periods


@dataclass(frozen=True)
class Floor:
    """Noise of each output, (O,) each."""

    rms: NDArray
    """N·m."""
    independent_share: NDArray
    """Independent samples per sample: noise is correlated from block to block."""
    from_periods: bool


def noise_floor(runs: Sequence[Run], residuals: Sequence[NDArray]) -> Floor:
    """Estimate the noise from differences between adjacent periods at the same phase.

    Slow drift cancels in the differences. Without periods the noise is the part above the motion's
    band, extrapolated below it: missing effects that are as fast count as noise.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, N·m.
    """
    pairs = [scatter(run, residual) for run, residual in zip(runs, residuals, strict=True)]
    from_periods = any(len(d) for d in pairs)
    averaged = np.inf
    if not from_periods:
        # Without periods, noise is the part that changes faster than averages of this length, s,
        # on an exoskeleton's scale.
        longest_s = 1.0
        lag = runs[0].motion.machine.lasting(longest_s)
        averaged = min(_blocks(run, lag) for run in runs)
        pairs = [_faster(run, residual, lag) for run, residual in zip(runs, residuals, strict=True)]
    outputs = residuals[0].shape[1]
    rms, share = np.full(outputs, np.nan), np.ones(outputs)
    for o in range(outputs):
        d = [p[:, o] for p in pairs if len(p)]
        known = np.concatenate(d)
        known = known[np.isfinite(known)]
        # Fewer differences determine neither a variance nor a correlation.
        if len(known) > 20:
            time = _correlation_time(d)
            # The subtracted average held a part of the noise too.
            rms[o] = np.sqrt(np.mean(known**2) / max(1.0 - time / averaged, 0.5))
            share[o] = 1.0 / time
    return Floor(rms, share, from_periods)


def scatter(run: Run, residual: NDArray) -> NDArray:
    """Return differences of adjacent periods at the same phase over the root of two.

    Parameters
    ----------
    run : Run
    residual : (m, O) array
        N·m.

    Returns
    -------
    (k, O) array
        N·m; NaN where a sample is not usable.
    """
    # With less than two periods, some phases of the motion would have no difference.
    period, width = run.motion.period_s, run.block.decimation / run.motion.sample_rate_hz
    if (
        not period
        or not len(run.time)
        or whole_periods(float(run.time[-1] - run.time[0]), width, period) < 2
    ):
        return np.zeros((0, residual.shape[1]))
    shift = period / width
    # Blocks are compared as they are where the period is a whole number of them.
    whole = round(shift)
    if abs(shift - whole) > 0.1:
        # The period is no whole number of blocks: interpolate between the two blocks around it.
        later = np.column_stack(
            [np.interp(run.time + period, run.time, r, right=np.nan) for r in residual.T]
        )
        ahead = np.clip(np.searchsorted(run.time, run.time + period), 1, len(run.time) - 1)
        # Across a gap there is nothing to interpolate.
        joined = run.time[ahead] - run.time[ahead - 1] < 1.5 * width
        usable = run.usable & run.usable[ahead] & run.usable[ahead - 1] & joined[:, np.newaxis]
        # Interpolation lowers the later noise's variance, on average to two thirds.
        return np.where(usable, (later - residual) / np.sqrt(1 + 2 / 3), np.nan)
    ahead = np.searchsorted(run.time, run.time + period - 0.25 * width)
    inside = ahead < len(run.time)
    now = np.flatnonzero(inside)
    later = ahead[inside]
    same_phase = np.abs(run.time[later] - run.time[now] - period) < 0.3 * width
    usable = run.usable[now] & run.usable[later] & same_phase[:, np.newaxis]
    # A difference of two independent values has twice the variance of one.
    return np.where(usable, (residual[later] - residual[now]) / np.sqrt(2), np.nan)


def _faster(run: Run, residual: NDArray, than_s: float) -> NDArray:
    """Return a residual (m, O) less its running average over ``than_s``.

    It is NaN where it is not usable. Next to a gap or a reversal the average is of usable samples
    only, at least half.
    """
    width = _blocks(run, than_s)
    known = uniform_filter1d(run.usable.astype(float), width, axis=0, mode="nearest")
    mean = uniform_filter1d(np.where(run.usable, residual, 0.0), width, axis=0, mode="nearest")
    return np.where(run.usable & (known > 0.5), residual - mean / np.maximum(known, 1e-9), np.nan)


def _blocks(run: Run, seconds: float) -> int:
    """Return the number of blocks in some seconds, at least 3."""
    return max(3, round(seconds * run.motion.sample_rate_hz / run.block.decimation))


def _correlation_time(series: Sequence[NDArray]) -> float:
    """Return the integrated autocorrelation time in samples, at least 1."""
    variance = np.nanmean(np.concatenate(series) ** 2)
    total = 1.0
    # The torque of a passive joint is constant: it has no noise.
    for lag in range(1, 40) if variance > 0.0 else ():
        products = np.concatenate([s[lag:] * s[:-lag] for s in series])
        # Between gaps no two blocks may be so far apart.
        if np.isnan(products).all():
            break
        rho = np.nanmean(products) / variance
        # Beyond the first small correlation the sum would collect errors of estimates.
        if not rho > 0.05:
            break
        total += 2 * rho
    return float(total)
