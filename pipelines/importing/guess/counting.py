"""Counters in a log: registers that lost their sign, or that wrap around."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.guess.joints import JointColumns
from pipelines.importing.guess.motion import TURNS
from pipelines.importing.quantities.numbers import are_whole
from pipelines.importing.quantities.wraparound import (
    full_at,
    sign_bit,
    signed,
    unwrapped,
    with_sign_bit,
)


@dataclass(frozen=True)
class Counting:
    """How a column was counted; all are None where it has plain numbers."""

    bits: int | None = None
    """Bits of a signed register that was logged as unsigned."""
    full: float | None = None
    """Reading at which it wraps around to 0."""
    sign: int | None = None
    """Bit of its sign, where the rest is a magnitude."""

    def undone(self, values: NDArray) -> NDArray:
        """Return readings with their sign and without wraparounds.

        Parameters
        ----------
        values : (n,) array
            As logged.

        Returns
        -------
        (n,) array
            In the unit of the log.
        """
        values = values.astype(float)
        if self.bits is not None:
            values = signed(values, self.bits)
        if self.sign is not None:
            values = with_sign_bit(values, self.sign)
        return values if self.full is None else unwrapped(values, self.full)


def countings(joint: JointColumns, columns: Mapping[str, NDArray]) -> dict[str, Counting]:
    """Return how each quantity of a joint was counted.

    Parameters
    ----------
    joint : JointColumns
        Columns and units of the joint.
    columns : mapping
        Columns of the log, (n,) each.

    Returns
    -------
    dict
        Counting by quantity.
    """
    logged = {quantity: columns[m.column].astype(float) for quantity, m in joint.columns.items()}
    counted = {quantity: _without_wraps(values) for quantity, values in logged.items()}
    unit = joint.columns["angle"].unit
    # Without a unit any of these may be a turn; an angle in counts wraps at a register.
    turns = [turn for name, turn in TURNS.items() if unit in (None, name)]
    full = full_at(counted["angle"].undone(logged["angle"]), turns)
    if full is None:
        return counted
    counted["angle"] = replace(counted["angle"], full=full)
    # A set-point may also step by a turn on purpose. It wraps around only where the angle does.
    reference = counted.get("reference")
    if reference is not None and full_at(reference.undone(logged["reference"]), turns) == full:
        counted["reference"] = replace(reference, full=full)
    return counted


def _without_wraps(values: NDArray) -> Counting:
    bits = lost_sign(values)
    return Counting(bits, sign=None if bits else sign_bit(values))


def lost_sign(values: NDArray) -> int | None:
    """Return the bits of a signed register that was logged as unsigned; None for other columns.

    Its values are whole and never negative. Some are in the upper half of the register, some near
    zero, and hardly any between.

    Parameters
    ----------
    values : (n,) array
        Readings, NaN where missing.
    """
    # Least share of rows in the upper half of a signed register; fewer may be outliers.
    few = 0.001
    known = values[np.isfinite(values)]
    if np.any(known < 0) or not are_whole(known):
        return None
    for bits in (16, 32):
        full = 2.0**bits
        # A little beyond, for digits that a float32 lost; values far beyond are of no register.
        held = known[known <= 1.0001 * full]
        upper = np.count_nonzero(held >= full / 2)
        lower = np.count_nonzero(held < full / 2)
        # A signed quantity near zero leaves the middle of the unsigned range empty; a counter
        # passes through it.
        empty = np.count_nonzero((held > 0.4 * full) & (held < 0.6 * full)) < 0.01 * len(known)
        # An outlier may lie above 2^15, but hardly above 2^31, where one row is enough.
        common = upper >= few * len(known) or (bits == 32 and upper)
        if common and lower and empty and len(held) > 0.98 * len(known):
            return bits
    return None
