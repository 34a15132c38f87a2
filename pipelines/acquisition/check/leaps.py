"""Leaps of a value from reading to reading of a device."""

from pipelines.acquisition.check.probe import Series
from pipelines.acquisition.leaps import leap


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
    return leap(series.block.registers[name], series.of(name)[series.fresh], of_turn)
