"""Zero-phase low-pass and the derivatives of what it leaves."""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, savgol_filter, sosfiltfilt

ORDER = 4
"""Order of one pass; forwards and backwards the filter falls with twice this."""

DERIVATIVE_STENCIL = 5
"""Samples in the difference formula: exact for polynomials of degree 4."""

NEGLIGIBLE = 1e-18
"""Of a cut in the data, what the filter may still feel of it: less than rounding."""


def reach(rate_hz: float, cutoff_hz: float, order: int = ORDER) -> int:
    """Return how many samples away a cut in the data is no longer felt: it fades as the slowest pole does."""
    _, poles, _ = butter(order, cutoff_hz, fs=rate_hz, output="zpk")
    fading = int(np.ceil(np.log(NEGLIGIBLE) / np.log(np.max(np.abs(poles)))))
    return max(fading, shortest(rate_hz, cutoff_hz), _padding(rate_hz, cutoff_hz)) + DERIVATIVE_STENCIL


def _padding(rate_hz: float, cutoff_hz: float) -> int:
    return int(3 * rate_hz / cutoff_hz)


def shortest(rate_hz: float, cutoff_hz: float) -> int:
    """Return the fewest samples a stretch needs to be filtered: one time constant's padding on each side."""
    return max(DERIVATIVE_STENCIL, int(np.ceil(rate_hz / cutoff_hz))) + 1


def low_pass(x: NDArray, rate_hz: float, cutoff_hz: float, order: int = ORDER) -> NDArray:
    """Filter forwards and backwards along the first axis, so that nothing is delayed.

    Parameters
    ----------
    x : (n, ...) array
        Uniform samples of one unbroken stretch, at least ``shortest(rate_hz, cutoff_hz)`` of them.
    rate_hz, cutoff_hz : float
        Sample rate; frequency at which one pass has fallen by 3 dB, below half the sample rate.
    """
    sections = butter(order, cutoff_hz, fs=rate_hz, output="sos")
    padding = min(len(x) - 1, _padding(rate_hz, cutoff_hz))
    return np.ascontiguousarray(sosfiltfilt(sections, x, axis=0, padlen=padding))


def derivative(x: NDArray, rate_hz: float, order: int) -> NDArray:
    """Differentiate uniform samples (n, ...) along the first axis, ``order`` 1 or 2, by central differences."""
    differences = savgol_filter(x, DERIVATIVE_STENCIL, DERIVATIVE_STENCIL - 1, deriv=order, delta=1.0 / rate_hz, axis=0)
    return np.ascontiguousarray(differences)
