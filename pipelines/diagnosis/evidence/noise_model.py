"""Estimate the noise of each output as a spectrum, without a model of the machine.

Differences of adjacent periods at the same phase hold noise and wandering torque. Torque that
wanders is slower than the band in which the noise is measured. The noise is the sum of first-order
noise and of pink noise,

    S(f) = S0 (1 / (1 + (2 pi f tau)^2) + pink F / f),  F = 1.5 Hz.

Without periods it is measured above the motion's own band, where its pink part cannot be
determined. Averages are whitened as noise of first order. Slower, pink noise is background that a
wandering torque has to exceed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.motion_band import above_the_motion_hz
from pipelines.diagnosis.evidence.noise_floor import scatter
from pipelines.diagnosis.evidence.observed_run import Run


@dataclass(frozen=True)
class NoiseModel:
    """Noise of each output, (O,) each; NaN where it is not known."""

    density: NDArray
    """Two-sided power density S0 of the first-order noise at low frequencies, (N·m)²/Hz."""
    correlation_s: NDArray
    pink: NDArray
    """Ratio of pink to first-order noise at ``pink_hz``."""
    from_periods: bool
    pink_hz: float = 1.5
    """Frequency at which pink noise is compared with first-order noise, Hz."""
    wander_hz: float = 0.25
    """Frequency below which differences between periods hold wandering torque as well as noise,
    Hz."""

    def at(self, hz: NDArray) -> NDArray:
        """Return the density at some frequencies.

        Below ``wander_hz`` its growth is an extrapolation.

        Parameters
        ----------
        hz : (k,) array
            Hz.

        Returns
        -------
        (O, k) array
            (N·m)²/Hz.
        """
        first = 1.0 / (1.0 + (2.0 * np.pi * np.multiply.outer(self.correlation_s, hz)) ** 2)
        # Slower than any run, Hz.
        tiny_hz = 1e-3
        pink = np.multiply.outer(self.pink, self.pink_hz / np.maximum(hz, tiny_hz))
        return (self.density * (first + pink).T).T

    def averaged(self, length_s: float) -> tuple[NDArray, NDArray]:
        """Return standard deviation and correlation of adjacent averages.

        Noise slower than ``WANDER_HZ`` counts as if it were at that frequency.

        Parameters
        ----------
        length_s : float
            Length of an average, s.

        Returns
        -------
        tuple of (O,) arrays
            N·m, and 0 to 1.
        """
        # An average passes the density times a squared sinc, and little above its fourth zero. The
        # density has two sides, hence the factor 2.
        hz = np.linspace(0.0, 4.0 / length_s, 2001)
        passed = self.at(np.maximum(hz, self.wander_hz)) * np.sinc(hz * length_s) ** 2
        variance = 2.0 * np.trapezoid(passed, hz, axis=1)
        adjacent = 2.0 * np.trapezoid(passed * np.cos(2.0 * np.pi * hz * length_s), hz, axis=1)
        return np.sqrt(variance), np.maximum(adjacent / variance, 0.0)

    def sigma(self, length_s: float) -> NDArray:
        """Return the effective standard deviation of averages for slow signals.

        Parameters
        ----------
        length_s : float
            Length of an average, s.

        Returns
        -------
        (O,) array
            N·m.
        """
        sd, memory = self.averaged(length_s)
        # Slow sums of correlated averages vary more than those of independent ones, by this factor.
        return np.asarray(sd * np.sqrt((1.0 + memory) / (1.0 - memory)))

    def excess(self, hz: NDArray, length_s: float) -> NDArray:
        """Return the excess of slow noise over first-order averages.

        Parameters
        ----------
        hz : (k,) array
            Hz.
        length_s : float
            Length of an average, s.

        Returns
        -------
        (O, k) array
            (N·m)²/Hz.
        """
        sd, memory = self.averaged(length_s)
        turn = np.multiply.outer(memory, np.cos(2.0 * np.pi * hz * length_s))
        # Whitening treats averages as a sequence of first order; this is the density of one.
        of_order_one = (sd**2 * (1.0 - memory**2) * length_s) / (1.0 + memory**2 - 2.0 * turn.T)
        return np.maximum(self.at(hz) - of_order_one.T, 0.0)


def noise_model(runs: Sequence[Run], residuals: Sequence[NDArray]) -> NoiseModel:
    """Estimate the noise of each output.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, N·m.

    Returns
    -------
    NoiseModel
    """
    differences = [scatter(run, residual) for run, residual in zip(runs, residuals, strict=True)]
    if any(len(one) for one in differences):
        # Highest frequency of the fit, Hz: blocks of 25 ms pass it, and impacts are mostly above.
        highest_hz = 6.0
        measured = runs[0].motion.machine.measured
        fits = _spectra(runs, differences, (NoiseModel.wander_hz, highest_hz))
        # With many gaps, hardly a block is usable in two periods.
        if np.isfinite(fits[0, : len(measured)][measured]).all():
            return NoiseModel(fits[0], fits[1], fits[2], from_periods=True)
    series = [
        np.where(run.usable, residual, np.nan)
        for run, residual in zip(runs, residuals, strict=True)
    ]
    above = max(above_the_motion_hz(run) for run in runs)
    # Highest start of the band without periods, and its end, Hz.
    latest, highest = 4.0, 8.0
    # Here the ratio of pink noise cannot be measured.
    fits = _spectra(runs, series, (min(above, latest), highest), pink=0.2)
    return NoiseModel(fits[0], fits[1], fits[2], from_periods=False)


def _spectra(
    runs: Sequence[Run],
    series: Sequence[NDArray],
    band: tuple[float, float],
    pink: float | None = None,
) -> NDArray:
    """Return density, correlation time and ratio of pink noise of each output, (3, O)."""
    rate_hz = runs[0].motion.sample_rate_hz / runs[0].block.decimation
    outputs = range(len(runs[0].measured[0]))
    return np.array(
        [_spectrum_of([x[:, o] for x in series if len(x)], rate_hz, band, pink) for o in outputs]
    ).T


def _spectrum_of(
    series: Sequence[NDArray], rate_hz: float, band: tuple[float, float], pink: float | None = None
) -> tuple[float, float, float]:
    """Fit noise to series that are NaN where not usable; return S0, tau and the pink share.

    ``pink`` is that share where it is known.
    Maximum likelihood of the periodogram (Whittle, 1953, Arkiv för Matematik 2(23)).
    """
    pieces = [piece for x in series for piece in _pieces(x, rate_hz, band)]
    sizes = np.array([power.sum() / share.sum() for _, power, share in pieces])
    if not sizes.any():
        return np.nan, np.nan, np.nan
    # Multiple of the median of all pieces above which a piece holds an event, not noise: a step in
    # one piece would raise the density of all.
    unlike = 3.0
    alike = sizes <= unlike * np.median(sizes)
    chosen = [piece for piece, is_alike in zip(pieces, alike, strict=True) if is_alike]
    frequency, power, share = (np.concatenate(parts) for parts in zip(*chosen, strict=True))
    # Correlation times tried, s. Noise of sensors and drives is no slower; slower torque wanders.
    correlation_s = np.concatenate([[0.0], np.geomspace(0.005, 0.25, 24)])
    # A band does not determine a correlation time longer than its slowest wave.
    tried = correlation_s[2.0 * np.pi * band[0] * correlation_s <= 1.0]
    first = 1.0 / (1.0 + (2.0 * np.pi * np.outer(tried, frequency)) ** 2)
    # Ratios of pink to first-order noise at `pink_hz` that are tried.
    ratios = np.array([0.0, 0.1, 0.2, 0.35, 0.6, 1.0, 1.7, 3.0] if pink is None else [pink])
    shapes = first[:, np.newaxis] + ratios[:, np.newaxis] * NoiseModel.pink_hz / frequency
    # For each shape the likeliest density is a closed form, so only shapes are tried. There
    # Whittle's sum of power / S is constant, and the sum of log S remains.
    densities = np.sum(power / shapes, axis=2) / share.sum()
    misfit = share.sum() * np.log(densities) + np.log(shapes) @ share
    t, p = np.unravel_index(np.argmin(misfit), misfit.shape)
    return float(densities[t, p]), float(tried[t]), float(ratios[p])


Piece = tuple[NDArray, NDArray, NDArray]


def _pieces(x: NDArray, rate_hz: float, band: tuple[float, float]) -> list[Piece]:
    """Return each piece's spectrum within a band, as of ``_of_piece``."""
    # Length of the pieces of a series whose spectra are taken, s.
    piece_s = 20.0
    pieces = np.array_split(x, max(1, round(len(x) / (piece_s * rate_hz))))
    # Fewest blocks of a series whose spectrum counts.
    shortest = 64
    return [
        _of_piece(piece, rate_hz, band) for piece in pieces if np.isfinite(piece).sum() >= shortest
    ]


def _of_piece(x: NDArray, rate_hz: float, band: tuple[float, float]) -> Piece:
    """Return a piece's frequencies (Hz), power densities, and remaining shares of white noise."""
    known, n = np.isfinite(x), len(x)
    # Largest number of slow cosines, as a share of a series' known blocks.
    largest_slow = 0.8
    count = min(int(2.0 * band[0] * n / rate_hz) + 1, int(largest_slow * known.sum()))
    # Slow cosines are fitted and subtracted, because slow content leaks into the band through
    # gaps. They also remove some faster content, whose share of white noise is known.
    slow = np.zeros((n, count))
    slow[known], _ = np.linalg.qr(_cosines(n, count)[known])
    value = np.where(known, x, 0.0)
    window = np.hanning(n) * known
    power = np.abs(np.fft.rfft(window * (value - slow @ (slow.T @ value)))) ** 2
    taken = np.sum(np.abs(np.fft.rfft(slow.T * window)) ** 2, axis=0)
    frequency, total = np.fft.rfftfreq(n, 1.0 / rate_hz), np.sum(window**2)
    inside = (frequency > band[0]) & (frequency < min(band[1], 0.45 * rate_hz))
    return frequency[inside], power[inside] / (total * rate_hz), 1.0 - taken[inside] / total


def _cosines(n: int, count: int) -> NDArray:
    """Return the slowest cosines over n samples, (n, count)."""
    return np.cos(np.pi * np.outer(np.arange(n) + 0.5, np.arange(count)) / n)
