"""The noise of each output as a spectrum, known without a model of the machine.

Differences of adjacent periods at the same phase hold noise and whatever wanders. What wanders is
slow, so the noise is read off above the band in which things wander and extended downwards by its
spectrum: first-order noise has the density S0 / (1 + (2 pi f tau)^2). Without periods the noise is
what lies above the motion's own band. S0, the density at low frequencies, is what the decision
needs, since columns of a model are slow: it counts coloured noise as it acts there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.dependence.spectral_lines import above_the_motion_hz
from pipelines.diagnosis.evidence.noise_floor import scatter
from pipelines.diagnosis.evidence.observed_run import Run

WANDER_HZ = 1.5
"""Below it differences between periods hold what wanders, not only noise, Hz."""
HIGHEST_HZ = 6.0
"""Highest frequency of the fit, Hz: blocks of 25 ms pass it, and impacts are mostly above."""
WITHOUT_PERIODS_HZ = (4.0, 8.0)
"""Without periods: where the band begins at the latest, and where it ends, Hz."""
CORRELATION_S = np.concatenate([[0.0], np.geomspace(0.005, 0.25, 24)])
"""Correlation times tried, s. Noise of sensors and drives is no slower; what is slower wanders."""
PIECE_S = 20.0
"""Length of the pieces of a series whose spectra are taken, s."""
SHORTEST = 64
"""Blocks that a series must have for its spectrum to count."""


@dataclass(frozen=True)
class NoiseModel:
    """First-order noise of each output, (O,) each; NaN where it is not known."""

    density: NDArray
    """Two-sided power density at low frequencies, (N·m)²/Hz."""
    correlation_s: NDArray
    from_periods: bool

    def sigma(self, length_s: float) -> NDArray:
        """Return the standard deviation that averages over ``length_s`` act with, (O,) N·m.

        It is that of white noise with the density which the noise has at low frequencies.
        """
        return np.sqrt(self.density / length_s)


def noise_model(runs: Sequence[Run], residuals: Sequence[NDArray]) -> NoiseModel:
    """Estimate the noise of each output from the residuals (m, O) of each run."""
    differences = [scatter(run, residual) for run, residual in zip(runs, residuals, strict=True)]
    from_periods = any(len(one) for one in differences)
    if from_periods:
        series, band = differences, (WANDER_HZ, HIGHEST_HZ)
    else:
        series = [np.where(run.usable, residual, np.nan) for run, residual in zip(runs, residuals, strict=True)]
        above = max(above_the_motion_hz(run) for run in runs)
        latest, highest = WITHOUT_PERIODS_HZ
        band = (min(above, latest), highest)
    rate_hz = runs[0].motion.sample_rate_hz / runs[0].block.decimation
    fits = [
        _first_order([one[:, o] for one in series if len(one)], rate_hz, band) for o in range(residuals[0].shape[1])
    ]
    density, correlation_s = np.array(fits).T
    return NoiseModel(density, correlation_s, from_periods)


def _first_order(series: Sequence[NDArray], rate_hz: float, band: tuple[float, float]) -> tuple[float, float]:
    """Fit first-order noise to series with NaN where they are not usable; return S0 and tau.

    Maximum likelihood of the periodogram (Whittle, 1953, Arkiv för Matematik 2(23)).
    """
    spectra = [_periodogram(x, rate_hz, band) for x in series]
    frequency = np.concatenate([f for f, _ in spectra] or [np.zeros(0)])
    power = np.concatenate([p for _, p in spectra] or [np.zeros(0)])
    if not power.any():
        return np.nan, np.nan
    shapes = 1.0 / (1.0 + (2.0 * np.pi * np.outer(CORRELATION_S, frequency)) ** 2)
    densities = np.mean(power / shapes, axis=1)
    misfit = len(power) * np.log(densities) + np.sum(np.log(shapes), axis=1)
    best = int(np.argmin(misfit))
    return float(densities[best]), float(CORRELATION_S[best])


def _periodogram(x: NDArray, rate_hz: float, band: tuple[float, float]) -> tuple[NDArray, NDArray]:
    """Return frequencies (Hz) and two-sided densities of a series (n,) within a band."""
    pieces = np.array_split(x, max(1, round(len(x) / (PIECE_S * rate_hz))))
    found = [_of_piece(piece, rate_hz, band) for piece in pieces]
    return np.concatenate([f for f, _ in found]), np.concatenate([p for _, p in found])


def _of_piece(x: NDArray, rate_hz: float, band: tuple[float, float]) -> tuple[NDArray, NDArray]:
    known, n = np.isfinite(x), len(x)
    slow = _cosines(n, int(2.0 * band[0] * n / rate_hz) + 1)
    if known.sum() < max(SHORTEST, 2 * slow.shape[1]):
        return np.zeros(0), np.zeros(0)
    # What is slow would leak into the band through the gaps.
    wanders, *_ = np.linalg.lstsq(slow[known], x[known], rcond=None)
    window = np.hanning(n) * known
    left = np.where(known, x - slow @ wanders, 0.0)
    power = np.abs(np.fft.rfft(left * window)) ** 2
    frequency = np.fft.rfftfreq(n, 1.0 / rate_hz)
    inside = (frequency > band[0]) & (frequency < min(band[1], 0.45 * rate_hz))
    return frequency[inside], power[inside] / (np.sum(window**2) * rate_hz)


def _cosines(n: int, count: int) -> NDArray:
    """Return the slowest cosines over n samples, (n, count)."""
    return np.cos(np.pi * np.outer(np.arange(n) + 0.5, np.arange(count)) / n)
