"""Sample rate and gaps of a series of time stamps: one definition for every stage."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, percentile_filter

AROUND = 201
"""Steps among which a step is compared: a rate that lasts for a tenth of them is usual there."""
HORIZON = 50
"""Samples within which a late stamp is followed by one that is not late."""
REACH = AROUND + HORIZON
"""Samples on each side by which the steps of one are judged."""


def local_period(time: NDArray) -> NDArray:
    """Return the median of the steps around each step, s.

    Parameters
    ----------
    time : (n,) array
        Increasing times, s; n is at least 2.

    Returns
    -------
    (n - 1,) array
        s.
    """
    return np.asarray(median_filter(np.diff(time), AROUND, mode="mirror"))


def missing_samples(time: NDArray) -> NDArray:
    """Return how many samples are missing between each sample and the next.

    Samples are missing where a step is half longer than the longest usual ones around it, and
    later stamps do not catch up: a late stamp delays only itself. A rate that changes, or varies,
    has other steps for long, so none is missing.

    Parameters
    ----------
    time : (n,) array
        Increasing times, s.

    Returns
    -------
    (n - 1,) array of int
        Zero where none is missing.
    """
    # Ratio to the longest usual step, and the step, s, that is a gap at any rate but a slower one.
    longer, pause_s = 1.5, 0.1
    steps = np.diff(time)
    missing = np.zeros(len(steps), dtype=np.int64)
    # An even clock has none, and needs no comparison.
    if not len(steps) or steps.max() <= longer * steps.min():
        return missing
    period = local_period(time)
    longest = longer * percentile_filter(steps, 95, AROUND, mode="mirror")
    limit = np.maximum(np.minimum(longest, pause_s), longer * period)
    (long,) = np.nonzero(steps > limit)
    # The lateness of the stamps that follow, in local periods, with the last one repeated.
    after = np.minimum(long[:, np.newaxis] + 1 + np.arange(HORIZON), len(time) - 1)
    expected = (after - long[:, np.newaxis]) * period[long, np.newaxis]
    late = (time[after] - time[long, np.newaxis] - expected) / period[long, np.newaxis]
    missing[long] = np.maximum(np.rint(late.min(axis=1)), 0.0)
    return missing


def sample_rate(time: NDArray) -> float:
    """Return the sample rate: one over the mean step where no sample is missing, Hz.

    The mean, as stamps of few digits round the median. A whole number of Hz, if that moves the last
    sample by less than 1 % of a period.

    Parameters
    ----------
    time : (n,) array
        Increasing times, s; n is at least 2.
    """
    steps = np.diff(time)
    whole_steps = steps[missing_samples(time) == 0]
    rate_hz = 1.0 / float(np.mean(whole_steps if len(whole_steps) else steps))
    whole = float(round(rate_hz))
    return whole if whole and abs(whole - rate_hz) * len(time) < 0.01 * rate_hz else rate_hz


def between_samples(time: NDArray, values: NDArray, at: NDArray) -> NDArray:
    """Interpolate linearly between samples, but not across gaps.

    Parameters
    ----------
    time : (n,) array
        Increasing times of the samples, s.
    values : (n,) array
        Samples, in any unit.
    at : (m,) array
        Times, s.

    Returns
    -------
    (m,) array
        In the unit of ``values``; NaN within gaps, before the first sample and after the last.
    """
    result = np.interp(at, time, values, left=np.nan, right=np.nan)
    is_gap = np.append(missing_samples(time) > 0, False)
    before = np.searchsorted(time, at, "right").clip(1) - 1
    # A sample at the edge of a gap is known, although the interval behind it is not.
    result[is_gap[before] & (time[before] != at)] = np.nan
    return result


def uneven_share(steps: NDArray) -> float:
    """Return the share of steps (n,) without gaps that are more than 2 % off their median."""
    median = np.median(steps)
    return float(np.mean(np.abs(steps - median) > 0.02 * median))


def whole_periods(duration_s: float, step_s: float, period_s: float) -> int:
    """Return the number of whole periods in a series of samples.

    Parameters
    ----------
    duration_s : float
        From the first sample to the last, s.
    step_s : float
        From one sample to the next, s. The last sample stands for such a step, too, so that n
        samples last n steps. The last period may lack one sample.
    period_s : float
        Period, s.
    """
    # The small number keeps a whole number of periods whole, in spite of rounding.
    return int((duration_s + 2.0 * step_s) / period_s + 1e-6)
