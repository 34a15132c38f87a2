"""Where a signal ends and its noise begins: the cut-off a low-pass should have."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

WINDOW_S = 10.0
NOISE_BAND = (0.6, 0.96)
"""Share of the Nyquist frequency where an angle holds nothing but noise."""
HIGHEST_SHARE = 0.25
"""Of the Nyquist frequency: above it the derivatives of noise outweigh what little signal is left."""
CLEAR = 3.0
"""A spectrum this many times its floor is signal."""


@dataclass(frozen=True)
class Cutoff:
    """A cut-off and why it was chosen."""

    hz: float
    reason: str


@dataclass(frozen=True)
class Spectrum:
    """Power spectral density of one channel and the level of its noise."""

    frequency_hz: NDArray
    density: NDArray
    """(f,) unit²/Hz."""
    floor: float
    meets_floor_hz: float


def spectrum(x: NDArray, rate_hz: float) -> Spectrum:
    """Estimate the spectrum of uniform samples (n,) and find where it sinks into its noise floor.

    A Blackman-Harris window, because the leakage of the slow motion would otherwise hide the floor.
    """
    length = min(len(x), int(WINDOW_S * rate_hz))
    frequency, density = welch(x, rate_hz, window="blackmanharris", nperseg=length, detrend="linear")
    nyquist = rate_hz / 2
    band = (frequency >= NOISE_BAND[0] * nyquist) & (frequency <= NOISE_BAND[1] * nyquist)
    floor = float(np.median(density[band]))
    # Running medians: one noisy line is neither the end of the signal nor more of it.
    width = max(1, len(frequency) // 100) | 1
    padded = np.pad(density, width // 2, mode="edge")
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=1)
    above = smooth > CLEAR * floor
    meets = frequency[np.argmin(above)] if not above.all() else nyquist
    return Spectrum(frequency, density, floor, float(meets))


def choose_cutoff(x: NDArray, rate_hz: float, channels: tuple[str, ...]) -> Cutoff:
    """Choose one cut-off for all channels of ``x`` (n, channels): the highest any of them needs."""
    meets = [spectrum(column, rate_hz).meets_floor_hz for column in x.T]
    widest = int(np.argmax(meets))
    highest = HIGHEST_SHARE * rate_hz / 2
    if meets[widest] > highest:
        return Cutoff(
            highest,
            f"the {channels[widest]} angle's spectrum meets its noise floor at {meets[widest]:.1f} Hz; "
            f"held to an eighth of the sample rate",
        )
    lowest = 2.0 / (len(x) / rate_hz)
    reason = f"the {channels[widest]} angle's spectrum meets its noise floor there"
    return Cutoff(max(meets[widest], lowest), reason)
