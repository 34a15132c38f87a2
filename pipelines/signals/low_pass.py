"""Zero-phase low-pass and the derivatives of what it leaves.

scipy.signal, which is slow to import, is imported by the functions that filter.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

ORDER = 4
"""Order of one pass; forwards and backwards the filter falls with twice this."""

DERIVATIVE_STENCIL = 5
"""Samples in the difference formula: exact for polynomials of degree 4."""

NEGLIGIBLE = 1e-18
"""Of a cut in the data, what the filter may still feel of it: less than rounding."""


def reach(rate_hz: float, cutoff_hz: float, order: int = ORDER) -> int:
    """Return how many samples away a cut in the data is no longer felt: it fades as the slowest
    pole does."""
    from scipy.signal import butter

    _, poles, _ = butter(order, cutoff_hz, fs=rate_hz, output="zpk")
    fading = int(np.ceil(np.log(NEGLIGIBLE) / np.log(np.max(np.abs(poles)))))
    return (
        max(fading, shortest(rate_hz, cutoff_hz), _padding(rate_hz, cutoff_hz)) + DERIVATIVE_STENCIL
    )


def _padding(rate_hz: float, cutoff_hz: float) -> int:
    return int(3 * rate_hz / cutoff_hz)


def shortest(rate_hz: float, cutoff_hz: float) -> int:
    """Return the fewest samples a stretch needs to be filtered: one time constant's padding on each
    side."""
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
    from scipy.signal import sosfiltfilt

    sections = _sections(order, cutoff_hz, rate_hz)
    padding = min(len(x) - 1, _padding(rate_hz, cutoff_hz))
    return np.ascontiguousarray(sosfiltfilt(sections, x, axis=0, padlen=padding))


@lru_cache
def _sections(order: int, cutoff_hz: float, rate_hz: float) -> NDArray:
    """Return the filter's second-order sections: their design takes longer than a short stretch's
    filtering."""
    from scipy.signal import butter

    return np.asarray(butter(order, cutoff_hz, fs=rate_hz, output="sos"))


@lru_cache
def _differences(order: int) -> NDArray:
    """Return the weights of a stencil's samples in the derivative at each of them, per sample."""
    from scipy.signal import savgol_coeffs

    size = DERIVATIVE_STENCIL
    return np.array(
        [savgol_coeffs(size, size - 1, deriv=order, pos=i, use="dot") for i in range(size)]
    )


def derivative(x: NDArray, rate_hz: float, order: int) -> NDArray:
    """Differentiate uniform samples (n, ...) along the first axis, ``order`` 1 or 2, by central
    differences.

    ``scipy.signal.savgol_filter`` does the same, and fits a polynomial at both ends of each stretch
    anew.
    """
    weights = _differences(order) * rate_hz**order
    half = DERIVATIVE_STENCIL // 2
    out = correlate1d(x, weights[half], axis=0, mode="nearest")
    # Summed in one order whatever the shape of x, so that a column alone gives the same to the last
    # digit.
    for end, samples in (
        (slice(half), x[:DERIVATIVE_STENCIL]),
        (slice(-half, None), x[-DERIVATIVE_STENCIL:]),
    ):
        out[end] = sum(
            np.multiply.outer(own, sample)
            for own, sample in zip(weights[end].T, samples, strict=True)
        )
    return np.asarray(out)
