"""Choose the cut-off of a low-pass: the frequency at which a signal sinks into its noise."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from pipelines.signals.welch import Welch


@dataclass(frozen=True)
class Cutoff:
    """A cut-off and the reason for it."""

    hz: float
    reason: str


@dataclass(frozen=True)
class Spectrum:
    """The level of one channel's noise, and the frequencies at which its signal ends."""

    floor: float
    """unit²/Hz."""
    meets_floor_hz: float
    motion_hz: float
    """Frequency below which nearly all of the signal's power lies."""


def spectrum(frequency: NDArray, density: NDArray, rate_hz: float) -> Spectrum:
    """Find where the spectrum of one channel sinks into its noise floor.

    Parameters
    ----------
    frequency : (f,) array
        Frequencies, Hz.
    density : (f,) array
        Power spectral density, unit²/Hz.
    rate_hz : float
        Sample rate.
    """
    # Band, as shares of the Nyquist frequency, in which an angle holds only noise.
    noise_band = (0.6, 0.96)
    # Share of the signal's power that counts as motion; the filter must not change it.
    slow_share = 0.9999
    # Width of a noise band above which no more signal is expected.
    quiet_hz = 3.0
    # Ratio to the noise floor above which a spectrum is signal.
    clear = 3.0
    nyquist = rate_hz / 2
    band = (frequency >= noise_band[0] * nyquist) & (frequency <= noise_band[1] * nyquist)
    # The median ignores single lines within the noise band, such as a hum.
    floor = float(np.median(density[band]))
    # Smooth first: single bins of a spectrum of few windows scatter by much of their own size.
    above = uniform_filter1d(density, max(1, len(frequency) // 100), mode="nearest") > clear * floor
    # A periodic motion has gaps between its lines: it ends where a wide band holds only noise.
    ahead = max(1, int(quiet_hz / frequency[1]))
    # The negative origin shifts the window, so that it looks ahead of each frequency.
    quiet = ~maximum_filter1d(above, ahead, origin=-(ahead // 2), mode="nearest")
    meets = frequency[np.argmax(quiet)] if quiet.any() else nyquist
    # Without this difference the noise of the whole band would count as motion.
    power = np.cumsum(np.maximum(density - floor, 0.0))
    motion = frequency[np.searchsorted(power, slow_share * power[-1])] if power[-1] > 0 else 0.0
    return Spectrum(floor, float(meets), float(min(motion, meets)))


def choose_cutoff(
    pieces: Iterable[NDArray], samples: int, rate_hz: float, channels: tuple[str, ...]
) -> Cutoff:
    """Choose one cut-off for all channels of a signal.

    Twice the highest frequency of the fastest motion always passes.

    Parameters
    ----------
    pieces : iterable of (n, channels) array
        The signal, piece by piece.
    samples : int
        Samples in all pieces together.
    rate_hz : float
        Sample rate.
    channels : tuple of str
        Names of the channels, for the reason.
    """
    # Cut-off over the frequency where signal and noise meet. In acceleration, noise exceeds the
    # signal well below that frequency.
    before_noise = 0.7
    # Windows of 10 s; a shorter recording is one window as a whole.
    welch = Welch(rate_hz, min(samples, int(10.0 * rate_hz)))
    for piece in pieces:
        welch.add(piece)
    spectra = [spectrum(welch.frequency_hz, density, rate_hz) for density in welch.density.T]
    # Limits of the highest cut-off, as shares of the Nyquist frequency. They act above 200 Hz and
    # below 100 Hz.
    least, most = (share * rate_hz / 2 for share in (0.125, 0.25))
    # Above 12.5 Hz is only the motion of joints that stick at reversals, and no fit uses that.
    highest = min(max(12.5, least), most)
    # The noisiest channel decides, because the acceleration of one joint enters the torque of
    # both.
    noisiest = int(np.argmin([s.meets_floor_hz for s in spectra]))
    meets = spectra[noisiest].meets_floor_hz
    fastest = int(np.argmax([s.motion_hz for s in spectra]))
    # Both passes together halve the amplitude at the cut-off; at half of it they take 0.4 %.
    needed = min(2.0 * spectra[fastest].motion_hz, highest)
    reason = f"the {channels[noisiest]} angle's spectrum meets its noise floor at {meets:.1f} Hz"
    chosen = before_noise * meets
    if chosen < needed:
        return Cutoff(
            needed, f"{reason}, but the {channels[fastest]} moves at up to {needed / 2:.1f} Hz"
        )
    if chosen > highest:
        return Cutoff(highest, f"{reason}; above {highest:g} Hz there are only reversals")
    return Cutoff(
        # One and a half periods at each end are invalid; a run at rest then keeps a quarter.
        max(chosen, 4.0 * rate_hz / samples),
        f"{reason}; in acceleration, noise exceeds the signal below that",
    )
