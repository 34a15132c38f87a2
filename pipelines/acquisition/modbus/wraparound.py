"""A device's counter and clock: carried on beyond the width of their registers, and held against
each other."""

RATE_TOLERANCE = 0.05
"""How far a device's clock may be from the rate that was asked for, as a share of it."""
CLOCK_SAMPLES = 0.5
"""How far it may be from its counter between two samples beside that, in samples."""


def carried(value: float, near: float, span: float) -> float:
    """Return what a register of a span held, with as many turns of it added as bring it near to a
    known count."""
    # What is less than half a span away is a turn; anything else is a step of the device's own.
    return value + span * round((near - value) / span) if span else value


class Counter:
    """Carries value after value on, forwards or, for an older one, backwards."""

    def __init__(self, span: float) -> None:
        self._span = span
        self._last: float | None = None

    def __call__(self, value: float) -> float:
        """Return the value with every turn of the register added."""
        self._last = value if self._last is None else carried(value, self._last, self._span)
        return self._last


def keeps_time(samples: float, seconds: float, rate_hz: float) -> bool:
    """Tell whether a clock went on as its counter did."""
    return abs(seconds * rate_hz - samples) <= CLOCK_SAMPLES + RATE_TOLERANCE * abs(samples)
