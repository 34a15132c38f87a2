"""A zero-phase low-pass and derivatives of its output."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

ORDER = 4
"""Order of one pass. Forwards and backwards together have twice this order."""

DERIVATIVE_STENCIL = 5
"""Samples in the difference formula; it is exact for polynomials of degree 4."""


def reach(rate_hz: float, cutoff_hz: float, order: int = ORDER) -> int:
    """Return the number of samples over which a cut in the data influences the filter.

    The influence decays with the slowest pole.

    Parameters
    ----------
    rate_hz, cutoff_hz : float
        Sample rate and cut-off, Hz.
    order : int, optional
        Order of the Butterworth filter, one way.

    Returns
    -------
    int
        Samples on each side of the cut.
    """
    # Share of a cut's influence that is ignored; it is below rounding.
    negligible = 1e-18
    from scipy.signal import butter

    _, poles, _ = butter(order, cutoff_hz, fs=rate_hz, output="zpk")
    # A pole of radius r fades as r to the power of samples; the largest radius fades last.
    fading = int(np.ceil(np.log(negligible) / np.log(np.max(np.abs(poles)))))
    # The margin also holds the filter's padding, and the stencil of the derivative.
    return (
        max(fading, shortest(rate_hz, cutoff_hz), _padding(rate_hz, cutoff_hz)) + DERIVATIVE_STENCIL
    )


def _padding(rate_hz: float, cutoff_hz: float) -> int:
    # In three periods of the cut-off, transients at the ends fade to less than a thousandth.
    return int(3 * rate_hz / cutoff_hz)


def shortest(rate_hz: float, cutoff_hz: float) -> int:
    """Return the least length of a stretch that can be filtered.

    Parameters
    ----------
    rate_hz, cutoff_hz : float
        Sample rate and cut-off, Hz.

    Returns
    -------
    int
        Samples: each side needs padding of at least one period of the cut-off.
    """
    return max(DERIVATIVE_STENCIL, int(np.ceil(rate_hz / cutoff_hz))) + 1


def low_pass(x: NDArray, rate_hz: float, cutoff_hz: float, order: int = ORDER) -> NDArray:
    """Filter forwards and backwards along the first axis, without delay.

    Parameters
    ----------
    x : (n, ...) array
        Uniform samples of one unbroken stretch, at least ``shortest(rate_hz, cutoff_hz)`` of them.
    rate_hz : float
        Sample rate.
    cutoff_hz : float
        Frequency at which one pass has fallen by 3 dB, below half the sample rate.
    order : int
        Order of one pass.

    Returns
    -------
    (n, ...) array
        Filtered samples, in the unit of ``x``.
    """
    from scipy.signal import sosfilt

    sections, steady = _sections(order, cutoff_hz, rate_hz)
    # One sample less than the data: a point reflection needs them.
    padding = min(len(x) - 1, _padding(rate_hz, cutoff_hz))
    columns = x.reshape(len(x), -1)
    before = 2.0 * columns[0] - columns[padding:0:-1]
    after = 2.0 * columns[-1] - columns[-2 : -2 - padding : -1]
    y = np.concatenate([before, columns, after])
    for _ in range(2):
        # Each pass begins as if its first sample had lasted for ever.
        y = sosfilt(sections, y, axis=0, zi=steady * y[0])[0][::-1]
    return np.ascontiguousarray(y[padding : padding + len(x)].reshape(x.shape))


# The design takes longer than filtering a short stretch: ``scipy.signal.sosfiltfilt`` computes the
# same, and the steady state again at each call.
@lru_cache
def _sections(order: int, cutoff_hz: float, rate_hz: float) -> tuple[NDArray, NDArray]:
    """Return the second-order sections (s, 6), and their steady state (s, 2, 1) at an input of 1.

    There are half as many sections as the order.
    """
    from scipy.signal import butter, sosfilt_zi

    # Second-order sections stay accurate where the cut-off is a small part of the sample rate.
    sections = np.asarray(butter(order, cutoff_hz, fs=rate_hz, output="sos"))
    return sections, sosfilt_zi(sections)[:, :, np.newaxis]


@lru_cache
def _differences(order: int) -> NDArray:
    """Return the weights (5, 5) of the derivative at each sample of a stencil, at 1 Hz."""
    from scipy.signal import savgol_coeffs

    size = DERIVATIVE_STENCIL
    # A polynomial of degree 4 through five samples is exact; row i is its derivative at sample i.
    return np.array(
        [savgol_coeffs(size, size - 1, deriv=order, pos=i, use="dot") for i in range(size)]
    )


def derivative(x: NDArray, rate_hz: float, order: int) -> NDArray:
    """Differentiate uniform samples along the first axis by central differences.

    ``scipy.signal.savgol_filter`` computes the same, but fits a polynomial again at both ends of
    each stretch.

    Parameters
    ----------
    x : (n, ...) array
        Uniform samples.
    rate_hz : float
        Sample rate.
    order : int
        Order of the derivative, 1 or 2.

    Returns
    -------
    (n, ...) array
        Derivative, in the unit of ``x`` per s or s².
    """
    weights = _differences(order) * rate_hz**order
    half = DERIVATIVE_STENCIL // 2
    # The first and last two samples are wrong here: their stencil reaches beyond the data.
    # One-sided differences replace them below.
    out = correlate1d(x, weights[half], axis=0, mode="nearest")
    # The order of summation is independent of the shape of x, so that results are reproducible
    # column by column.
    for end, samples in (
        (slice(half), x[:DERIVATIVE_STENCIL]),
        (slice(-half, None), x[-DERIVATIVE_STENCIL:]),
    ):
        out[end] = sum(
            np.multiply.outer(own, sample)
            for own, sample in zip(weights[end].T, samples, strict=True)
        )
    return np.asarray(out)
