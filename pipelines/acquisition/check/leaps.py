"""Leaps of a value from reading to reading, by a turn or a power of two of counts."""

from math import pi

import numpy as np

from pipelines.acquisition.check.probe import Series


def leap_of(series: Series, name: str, of_turn: bool = False) -> float | None:
    """Return the counts by which a value leaps, and goes on from there; None where it does not.

    Parameters
    ----------
    series : Series
        Repeated readings of its block.
    name : str
        The quantity.
    of_turn : bool
        Whether it may leap by a turn, too.
    """
    register = series.block.registers[name]
    if register.turn or len(series.fresh) < 2:
        return None
    per_count = abs(register.si[0])
    counts = series.of(name)[series.fresh] / per_count
    steps = np.abs(np.diff(counts))
    # A leap is half of all that the value does; all else is small against it.
    leaps = steps > 0.5 * np.ptp(counts)
    if not leaps.any() or leaps.all():
        return None
    usual = float(steps[~leaps].max())
    if usual > 0.125 * steps[leaps].min():
        return None
    turn = (2.0 * pi / per_count,) if of_turn else ()
    for full in (*turn, *(2.0**bits for bits in range(8, 33))):
        if (np.abs(steps[leaps] - full) <= 2.0 * usual + 1.0).all():
            return full
    return None
