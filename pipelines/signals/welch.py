"""Estimate a power spectral density piece by piece.

Source: Welch (1967), IEEE Trans. Audio 15(2).
"""

import numpy as np
from numpy.typing import NDArray


class Welch:
    """Average the spectra of windows that overlap by half, across pieces.

    A Blackman-Harris window is used, because leakage of a slow motion would otherwise hide the
    noise floor.

    Parameters
    ----------
    rate_hz : float
        Sample rate.
    length : int
        Samples in a window.
    """

    def __init__(self, rate_hz: float, length: int) -> None:
        self._rate_hz = rate_hz
        self._length = length
        # The same hop as of scipy's welch, so that windows of all pieces lie on one grid.
        self._hop = length - length // 2
        self._rest: NDArray | None = None
        self._total: NDArray | float = 0.0
        self._windows = 0
        self.frequency_hz: NDArray = np.fft.rfftfreq(length, 1.0 / rate_hz)

    def add(self, x: NDArray) -> None:
        """Add the next samples of a piece.

        Parameters
        ----------
        x : (n, channels) array
            They follow those of the call before.
        """
        # Only here, as in `low_pass`: importing scipy.signal takes half a second.
        from scipy.signal import welch

        x = x if self._rest is None else np.concatenate([self._rest, x])
        windows = max(0, (len(x) - self._length) // self._hop + 1)
        # Whole windows only: the rest waits for the next piece.
        if windows:
            whole = x[: (windows - 1) * self._hop + self._length]
            _, density = welch(
                whole,
                self._rate_hz,
                window="blackmanharris",
                nperseg=self._length,
                # A drift over the window would leak into all frequencies.
                detrend="linear",
                axis=0,
            )
            # scipy returns the mean over windows, so pieces count by their number of windows.
            self._total = self._total + windows * density
            self._windows += windows
        self._rest = x[windows * self._hop :]

    @property
    def density(self) -> NDArray:
        """Power spectral density, (f, channels) unit²/Hz; needs at least one window."""
        return np.asarray(self._total / self._windows)
