"""Compute spectra of a residual torque: log likelihood ratios of lines over angle or time.

With the score z and the weight w of ``whitened_residual``, angle q and speed v,

    P(n) = |sum_k z_k exp(-i n q_k)|^2 / D(n),   D(n) = sum_k w(n |v_k| / 2 pi)

is the log likelihood ratio of a line of n cycles a turn against none (Scargle, 1982, Astrophysical
Journal 263). With noise alone it is exponential with mean one. Real noise is never quite
stationary, so P is divided by its own level at the orders around, where that is more than one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.special import fdtrc, gammaincinv

from pipelines.diagnosis.evidence.whitened_residual import TINY, Channel


class Kind(StrEnum):
    """The variable over which a line is periodic."""

    ANGLE = "angle"
    TIME = "time"


@dataclass(frozen=True)
class Spectrum:
    """Log likelihood ratio of a line at each of m places."""

    kind: Kind
    cycles: NDArray
    """(m,) cycles a turn, or Hz."""
    log_likelihood_ratio: NDArray
    """(m,) against noise of the same local colour."""
    level: NDArray
    """(m,) by which the ratio against stationary noise was divided."""
    width: float
    """Width of a line, in cycles a turn or Hz: independent places are that far apart."""
    phases: int
    """Phases that a line has: one for all runs over angle, one in each run over time."""
    around: int = 1
    """Line widths over which the median of the local level is taken."""

    @property
    def steep_level(self) -> NDArray:
        """The level after all lines are subtracted, (m,), from nearer neighbours too."""
        places = max(1, round(self.width / (self.cycles[1] - self.cycles[0])))
        # Line widths of a median where the level may be steep. A line itself would raise so narrow
        # a median.
        narrow = 6
        near = _level(self.log_likelihood_ratio * self.level, narrow * places, self.phases)
        return np.maximum(self.level, near)

    def false_alarm(self, ratio: float, searches: int) -> float:
        """Return the chance that noise shows such a ratio anywhere in some similar spectra.

        Parameters
        ----------
        ratio : float
            Log likelihood ratio of a line.
        searches : int
            Number of similar spectra.

        Returns
        -------
        float
            0 to 1.
        """
        if not len(self.cycles):
            return 1.0
        # The level is an estimate too, so the ratio has an F distribution. A median of k values has
        # half the efficiency of their mean.
        tail = float(fdtrc(2 * self.phases, self.around, ratio / self.phases))
        # Maxima between independent places are higher than at them.
        places = 2.5 * (1.0 + (self.cycles[-1] - self.cycles[0]) / self.width)
        # By logarithms, because a small chance would be lost to rounding in 1 - p.
        return float(-np.expm1(searches * places * np.log1p(-min(tail, 1.0 - 1e-12))))


class Orders(NamedTuple):
    """The range of orders of a joint that is searched."""

    swept: float
    """rad, the range of angles that it moves through."""
    lowest: float
    """Cycles a turn."""
    highest: float

    @property
    def width(self) -> float:
        """Of a line, in cycles a turn."""
        return 2.0 * np.pi / self.swept


def nothing(kind: Kind) -> Spectrum:
    """Return the spectrum of a joint that cannot be searched."""
    return Spectrum(kind, np.zeros(0), np.zeros(0), np.zeros(0), 1.0, 1)


def spectrum_over_angle(channels: Sequence[Channel], searched: Orders) -> Spectrum:
    """Return the spectrum over a joint's angle, of lines that have one phase in all channels.

    Parameters
    ----------
    channels : sequence of Channel
        The joint's residual in each run.
    searched : Orders
        Range and width of the search, cycles per turn.
    """
    # Points of the angle's grid in a wave of the highest order.
    points_per_wave = 8
    # Sum the scores over a grid of angles: there a line is periodic at any speed.
    finest = points_per_wave * searched.highest
    step = 2.0 * np.pi / finest
    first = min(float(channel.grid.angle.min()) for channel in channels)
    total = np.zeros(int(searched.swept / step) + 3)
    for channel in channels:
        # Each score is split between its two neighbours on the grid.
        place = (channel.grid.angle - first) / step
        below = place.astype(int)
        share = place - below
        total += np.bincount(below, channel.score * (1.0 - share), len(total))
        total += np.bincount(below + 1, channel.score * share, len(total))
    # Number of orders within the width of a line at which the spectrum over angle is computed.
    oversampled = 8
    # Zero padding: a line between two orders of a coarse spectrum would lose power.
    points = max(len(total), int(oversampled * finest / searched.width))
    length = fft.next_fast_len(points, real=True)
    transform = fft.rfft(total, length)
    orders = np.arange(len(transform)) * (finest / length)
    kept = (orders >= searched.lowest) & (orders <= searched.highest)
    if not kept.any():
        return nothing(Kind.ANGLE)
    orders = orders[kept]
    # Splitting damps the transform by the square of a sinc.
    power = np.abs(transform[kept]) ** 2 / np.sinc(orders * step / (2.0 * np.pi)) ** 4
    # The information changes slowly with the order, so it is interpolated between some.
    some = orders[:: max(1, len(orders) // 256)]
    information = np.sum([_information_at(channel, some) for channel in channels], axis=0)
    # Least information about an order, as a share of that about the best known one; smaller
    # values are raised to it.
    least_informed = 1e-3
    information = np.maximum(information, least_informed * np.max(information))
    ratio = power / np.interp(orders, some, information)
    # Line widths over which the median of the local level is taken over the angle.
    around = 20
    # Over many turns a line is narrow, and what surrounds it within a cycle is its own.
    around = round(around * max(1.0, 1.0 / searched.width))
    level = _level(ratio, oversampled * around, 1)
    return Spectrum(Kind.ANGLE, orders, ratio / level, level, searched.width, 1, around)


def _information_at(channel: Channel, orders: NDArray) -> NDArray:
    """Return D of the equation above at some orders (m,), from representative speeds."""
    hz = orders[:, np.newaxis] * channel.grid.usual_hz_per_order
    weight = channel.weight(hz).mean(axis=1)
    return np.asarray(len(channel.score) * weight) + TINY


def spectrum_over_time(channels: Sequence[Channel], least_hz: float) -> Spectrum:
    """Return the spectrum over time, of lines that have a phase of their own in each channel.

    Parameters
    ----------
    channels : sequence of Channel
        The joint's residual in each run.
    least_hz : float
        Lowest frequency to search, Hz.
    """
    # All runs are padded to twice the longest, so that their frequencies agree.
    longest = max(len(channel.grid.mask) / channel.grid.rate_hz for channel in channels)
    step = 0.5 / longest
    count = int(0.5 * min(channel.grid.rate_hz for channel in channels) / step)
    kept = np.arange(int(np.ceil(least_hz / step)), count)
    if len(kept) < 2:
        return nothing(Kind.TIME)
    hz, ratio = step * kept, np.zeros(len(kept))
    for channel in channels:
        grid = channel.grid
        x = np.zeros(round(grid.rate_hz / step))
        x[grid.place] = channel.score
        information = np.maximum(len(channel.score) * channel.weight(hz), TINY)
        # Each run has its own phase, so ratios add up, not amplitudes.
        ratio += np.abs(fft.rfft(x)[kept]) ** 2 / information
    # The same over time, where lines are narrower than colours of noise.
    around = 120
    level = _level(ratio, 2 * around, len(channels))
    if channels[0].grid.period_s:
        level = _with_harmonics(hz, ratio, level, channels[0].grid.period_s, len(channels))
    return Spectrum(Kind.TIME, hz, ratio / level, level, 2.0 * step, len(channels), around)


def _level(ratio: NDArray, around: int, phases: int) -> NDArray:
    """Return the ratios' local level over that of stationary noise, (m,) >= 1."""
    edges = np.linspace(0, len(ratio), max(1, len(ratio) // around) + 1).astype(int)
    medians = [np.median(ratio[a:b]) for a, b in pairwise(edges)]
    middle = 0.5 * (edges[:-1] + edges[1:])
    # In stationary noise a sum of ``phases`` ratios has a gamma distribution with this median.
    level = np.interp(np.arange(len(ratio)), middle, medians) / float(gammaincinv(phases, 0.5))
    # A quiet neighbourhood must not raise a ratio.
    return np.maximum(level, 1.0)


def _with_harmonics(
    hz: NDArray,
    ratio: NDArray,
    level: NDArray,
    period_s: float,
    phases: int,
) -> NDArray:
    """Return the level, raised at the motion's harmonics to the highest of others around.

    All torque that repeats with the motion has lines there, of very different heights.
    """
    step = hz[1] - hz[0]
    first, last = np.ceil(hz[0] * period_s), np.floor(hz[-1] * period_s)
    harmonics = np.arange(first, last + 1.0) / period_s
    if not len(harmonics):
        return level
    # A harmonic falls between grid points, so the highest of three counts as its height.
    place = np.clip(np.round((harmonics - hz[0]) / step).astype(int), 1, len(hz) - 2)
    at = np.maximum(np.maximum(ratio[place - 1], ratio[place]), ratio[place + 1])
    # Number of the motion's harmonics on each side that are compared with one.
    around = 8
    padded = np.pad(at, around, mode="edge")
    neighbours = [np.roll(padded, k) for k in range(-around, around + 1) if k]
    highest = np.max(neighbours, axis=0)[around:-around] / phases
    number = np.round(hz * period_s)
    near = np.abs(hz * period_s - number) < 2.0 * step * period_s
    raised = highest[np.clip(number - first, 0, len(harmonics) - 1).astype(int)]
    return np.where(near, np.maximum(level, raised), level)


def information(channel: Channel, kind: Kind, cycles: float) -> float:
    """Return D of the equation above for one line.

    Parameters
    ----------
    channel : Channel
        A joint's residual in one run.
    kind : Kind
        Whether the line is over angle or time.
    cycles : float
        Per turn, or Hz.

    Returns
    -------
    float
        Samples times 1/(N·m)².
    """
    if kind is Kind.TIME:
        return len(channel.score) * float(channel.weight(np.array(cycles))) + TINY
    return float(_information_at(channel, np.array([cycles]))[0])
