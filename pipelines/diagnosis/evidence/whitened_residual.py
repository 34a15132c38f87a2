"""Weight one joint's residual torque by its noise, at the full sampling rate.

Slow content is removed. With S the spectrum of the noise, the score of a residual r is z = r / S,
as in generalized least squares. The likelihood of a line needs only its product with z and the
weight 1 / S at its own frequency, also where that frequency follows the speed.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.ndimage import median_filter

from pipelines.estimation.regression import away_from_reversals
from pipelines.mechanics.motion import Motion

TINY = 1e-300
"""Keeps the division by a spectrum without power finite."""


@dataclass(frozen=True)
class Trace:
    """One joint's residual torque in one run; n samples at the full sampling rate."""

    time: NDArray
    """(n,) s."""
    angle: NDArray
    """(n,) rad."""
    speed: NDArray
    """(n,) rad/s."""
    residual: NDArray
    """(n,) N·m."""
    usable: NDArray
    """(n,) bool: valid, and away from the joint's reversals."""
    rate_hz: float
    period_s: float | None = None
    """Of the motion, where it repeats."""


def traces_of(motion: Motion, residual: NDArray) -> list[Trace]:
    """Return each joint's trace in a run.

    Parameters
    ----------
    motion : Motion
        n samples of J joints.
    residual : (n, J) array
        N·m.

    Returns
    -------
    list of Trace
        Samples near reversals, or without a residual or a measured torque, are not usable.
    """
    known = np.isfinite(residual) & motion.machine.measured
    usable = motion.valid[:, np.newaxis] & away_from_reversals(motion) & known
    return [
        Trace(
            motion.time,
            motion.q[:, j],
            motion.dq[:, j],
            residual[:, j],
            usable[:, j],
            motion.sample_rate_hz,
            motion.period_s,
        )
        for j in range(len(motion.joints))
    ]


@dataclass(frozen=True)
class Grid:
    """A trace's u usable samples on a uniform grid of N instants."""

    rate_hz: float
    period_s: float | None
    time: NDArray
    """(u,) s, from their middle."""
    angle: NDArray
    """(u,) rad."""
    hz_per_order: NDArray
    """(u,) frequency of a line of one cycle a turn."""
    usual_hz_per_order: NDArray
    """(``SPEEDS``,) representative values of these frequencies."""
    residual: NDArray
    """(u,) N·m."""
    place: NDArray
    """(u,) place of each sample on the grid."""
    mask: NDArray
    """(N,) 1 where a sample is usable, 0 elsewhere."""
    around: NDArray
    """(N,) share of the smoothing window that is usable."""
    hz: NDArray
    """(k,) frequencies of a transform."""
    smooth: NDArray
    """(k,) share that the smoothing passes: the slow content."""
    passed: NDArray
    """(k,) 0 where content is slow, 1 where it is not."""

    @classmethod
    def of(cls, trace: Trace, slow_hz: float) -> "Grid":
        """Place a trace on a uniform grid.

        Parameters
        ----------
        trace : Trace
            A joint's residual in one run.
        slow_hz : float
            Content below counts as slow, Hz.
        """
        used = trace.usable
        hz_per_order = np.abs(trace.speed[used]) / (2.0 * np.pi)
        place = np.round((trace.time - trace.time[0]) * trace.rate_hz).astype(int)
        # The grid has a place for every instant, so that phases stay right across gaps.
        mask = np.zeros(fft.next_fast_len(int(place[-1]) + 1, real=True))
        mask[place[used]] = 1.0
        hz = fft.rfftfreq(len(mask), 1.0 / trace.rate_hz)
        # A Gaussian window whose width is a quarter of the slow frequency's period.
        smooth = np.exp(-2.0 * (np.pi * hz * 0.25 / slow_hz) ** 2)
        # Number of speeds that represent all of a joint's: a line's frequency follows them.
        speeds = 64
        return cls(
            trace.rate_hz,
            trace.period_s,
            trace.time[used] - np.mean(trace.time[used]),
            trace.angle[used],
            hz_per_order,
            np.quantile(hz_per_order, (np.arange(speeds) + 0.5) / speeds),
            trace.residual[used],
            place[used],
            mask,
            np.maximum(_filtered(mask, smooth), 1e-3),
            hz,
            smooth,
            np.clip(2.0 * hz / slow_hz - 1.0, 0.0, 1.0),
        )

    def channel(self, residual: NDArray) -> "Channel":
        """Return a residual torque without slow content, and its score.

        Parameters
        ----------
        residual : (u,) array
            N·m.
        """
        fast = self.fast(residual)
        spectrum = np.interp(self.hz, *noise(fast, self.mask, self.rate_hz))
        # The score is F' (F r) / S, with the filter F = 1 - smooth that lines pass too. The
        # spectrum is that of F r: where F is nearly zero the ratio would explode, hence the ramp.
        gain = self.passed * (1.0 - self.smooth) / spectrum
        return Channel(self, gain, _filtered(fast, gain)[self.place])

    def fast(self, torque: NDArray) -> NDArray:
        """Return a torque without slow content on the grid.

        Parameters
        ----------
        torque : (u,) array
            N·m.

        Returns
        -------
        (N,) array
            N·m.
        """
        x = np.zeros_like(self.mask)
        x[self.place] = torque
        # Divided by the usable share of the window, the local mean is right next to gaps.
        return (x - _filtered(x, self.smooth) / self.around) * self.mask


@dataclass(frozen=True)
class Channel:
    """The score and weights of a residual, from which a line's likelihood follows."""

    grid: Grid
    gain: NDArray
    """(k,) factor from torque to score at each of the grid's frequencies, 1/(N·m)²."""
    score: NDArray
    """(u,) of the residual, 1/(N·m)."""

    @cached_property
    def weights(self) -> NDArray:
        """Weight of a sample of a line at each of the grid's frequencies, (k,) 1/(N·m)^2."""
        return np.asarray(self.gain * (1.0 - self.grid.smooth))

    def score_of(self, torque: NDArray) -> NDArray:
        """Return the score of another torque under the same noise.

        Parameters
        ----------
        torque : (u,) array
            N·m.

        Returns
        -------
        (u,) array
            1/(N·m).
        """
        return _filtered(self.grid.fast(torque), self.gain)[self.grid.place]

    def weight(self, hz: NDArray) -> NDArray:
        """Return the weight of a sample of a line.

        Above half of the sampling rate a line is aliased to a lower frequency.

        Parameters
        ----------
        hz : (m,) array
            Frequencies, Hz.

        Returns
        -------
        (m,) array
            1/(N·m)².
        """
        rate = self.grid.rate_hz
        folded = np.abs((hz + 0.5 * rate) % rate - 0.5 * rate)
        # The frequencies are equidistant, so places follow without a search.
        place = np.minimum(folded / self.grid.hz[1], len(self.weights) - 1.001)
        below = place.astype(int)
        share = place - below
        return np.asarray((1.0 - share) * self.weights[below] + share * self.weights[below + 1])


def _filtered(x: NDArray, response: NDArray) -> NDArray:
    """Return samples (N,) whose transform is multiplied by a response (k,)."""
    return np.asarray(fft.irfft(fft.rfft(x) * response, len(x)))


def noise(x: NDArray, mask: NDArray, rate_hz: float) -> tuple[NDArray, NDArray]:
    """Estimate the spectrum of noise by Welch's method.

    Spectra of half-overlapping segments are averaged (Welch, 1967, IEEE Trans. Audio and
    Electroacoustics 15(2)), weighted by their usable part.

    Parameters
    ----------
    x : (N,) array
        Samples, zero where not usable, N·m.
    mask : (N,) array
        1 where a sample is usable, 0 elsewhere.
    rate_hz : float

    Returns
    -------
    (k,) array
        Frequencies, Hz.
    (k,) array
        Power of a sample at them, (N·m)².
    """
    # Length of the segments whose spectra are averaged to the noise's, s.
    segment_s = 1.28
    length = min(len(x), max(32, round(segment_s * rate_hz)))
    window = np.hanning(length)
    starts = np.arange(0, len(x) - length + 1, max(1, length // 2))
    rows = starts[:, np.newaxis] + np.arange(length)
    # Segments count by their usable part, or gaps would lower the noise.
    used = max(float(np.sum(mask[rows] * window**2)), 1e-12)
    power = np.sum(np.abs(fft.rfft(x[rows] * window, axis=1)) ** 2, axis=0) / used
    # Number of frequencies whose median is taken, so that a hum does not count as noise.
    smoothed = 9
    around = median_filter(power, smoothed, mode="nearest")
    return fft.rfftfreq(length, 1.0 / rate_hz), np.maximum(around, 1e-9 * power.max() + TINY)
