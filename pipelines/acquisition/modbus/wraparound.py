"""Counters and clocks of devices: without wraparound, and compared with each other."""

RATE_TOLERANCE = 0.05
"""Largest relative difference between a device's rate and the expected one."""
CLOCK_TOLERANCE = 0.01
"""Largest error of a device's clock as a whole: a quartz is within 0.01 %, an RC oscillator 1 %."""


def unwrap(value: float, near: float, modulus: float) -> float:
    """Return a value plus the multiple of its register's modulus that is closest to another.

    Parameters
    ----------
    value : float
        As the register shows it.
    near : float
        Where the result is expected.
    modulus : float
        Value at which the register starts again at 0; 0 for one without wraparound.
    """
    return value + modulus * round((near - value) / modulus) if modulus else value


class Unwrapper:
    """Removes the wraparounds of successive values, which may go forwards or backwards."""

    def __init__(self, modulus: float) -> None:
        self._modulus = modulus
        self._last: float | None = None

    def __call__(self, value: float) -> float:
        """Return the next value without wraparound."""
        self._last = value if self._last is None else unwrap(value, self._last, self._modulus)
        return self._last


def keeps_time(samples: float, seconds: float, rate_hz: float) -> bool:
    """Return whether a clock advanced by as much as its sample counter.

    Parameters
    ----------
    samples : float
        Advance of the counter.
    seconds : float
        Advance of the clock, s.
    rate_hz : float
        Sample rate, Hz.
    """
    # Further difference allowed between clock and counter of two samples, in samples.
    clock_samples = 0.5
    return abs(seconds * rate_hz - samples) <= clock_samples + RATE_TOLERANCE * abs(samples)
