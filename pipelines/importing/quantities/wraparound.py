"""Counters: registers logged without their sign, and readings that wrap around at 0."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from pipelines.importing.finding import Note, counted, unnoted
from pipelines.importing.quantities.numbers import TAKEN_FOR_MISSING
from pipelines.signals.sampling import missing_samples

# Every width, as encoders also have 12, 14 or 17 bits, and wrap at their own modulus.
REGISTERS = tuple(2.0**bits for bits in range(8, 33))
"""Moduli of counters of whole numbers."""


def signed(values: NDArray, bits: int, note: Note = unnoted) -> NDArray:
    """Return the values of a signed register that was logged as unsigned (two's complement).

    A value that the register cannot hold becomes NaN. An example is 4.2949673e9, a number near 2^32
    that lost its last digits: its sign is known, but not its value.

    Parameters
    ----------
    values : (n,) array
        Readings from 0 to ``2**bits - 1``.
    bits : int
        Bits of the register.
    note : callable
        Takes what is reported about the register.

    Returns
    -------
    (n,) array
        Readings with their sign.
    """
    impossible = (values >= 2.0**bits) | (values < -(2.0 ** (bits - 1)))
    if impossible.any():
        first = values[np.argmax(impossible)]
        seen = (
            f"{counted(int(impossible.sum()), 'row')} that {bits} bits cannot hold, the first"
            f" {first:.10g}"
        )
        note(seen, TAKEN_FOR_MISSING)
    negative = values >= 2.0 ** (bits - 1)
    if (negative & ~impossible).any():
        share = np.count_nonzero(negative & ~impossible) / len(values)
        seen = (
            f"a signed register of {bits} bits logged without its sign, {share:.0%} of it below 0"
        )
        note(seen, f"less 2^{bits} there")
    return np.where(impossible, np.nan, np.where(negative, values - 2.0**bits, values))


def with_sign_bit(values: NDArray, bit: int, note: Note = unnoted) -> NDArray:
    """Return the values of a register that holds a magnitude, and a bit that is set below zero.

    Parameters
    ----------
    values : (n,) array
        Readings, ``2**bit`` and more where negative.
    bit : int
        Number of the bit; 15 is the highest of 16.
    note : callable
        Takes what is reported about the register.

    Returns
    -------
    (n,) array
        Readings with their sign.
    """
    negative = values >= 2.0**bit
    if negative.any():
        note(f"bit {bit} is the sign, set in {np.mean(negative):.0%} of the rows", "turned round")
    return np.where(negative, 2.0**bit - values, values)


def sign_bit(values: NDArray) -> int | None:
    """Return the bit that is the sign of a register of magnitudes; None for other columns.

    Readings are whole and never negative. Once turned round they go on without the steps by
    ``2**bit`` that they have as logged, and no magnitude comes near that bit.

    Parameters
    ----------
    values : (n,) array
        Readings, NaN where missing.
    """
    known = values[np.isfinite(values)]
    if len(known) < 2 or np.any(known < 0) or np.any(known != np.round(known)):
        return None
    bit = int(np.log2(max(float(np.max(known)), 1.0)))
    decoded = with_sign_bit(known, bit)
    same = np.sign(decoded[1:]) == np.sign(decoded[:-1])
    steps = np.abs(np.diff(decoded))
    if bit < 7 or not same.any() or same.all():
        return None
    # Steps across zero are no larger than twice those to one side of it.
    usual = 2.0 * float(np.max(steps[same])) + 2.0
    room = 2.0**bit - float(np.max(np.abs(decoded)))
    return bit if np.max(steps[~same]) <= usual < room else None


def unwrapped(values: NDArray, modulus: float, note: Note = unnoted, near: float = 0.0) -> NDArray:
    """Return a counter without its wraparounds, so that no step exceeds half the modulus.

    Parameters
    ----------
    values : (n,) array
        Readings, NaN where missing.
    modulus : float
        Reading at which the counter starts again at 0.
    note : callable
        Takes what is reported about the counter.
    near : float, optional
        The counter begins in the turn in which its first reading lies nearest to it.

    Returns
    -------
    (n,) array
        Readings that go on across wraparounds.
    """
    known = np.isfinite(values)
    if not known.any():
        return values
    first = values[known][0]
    # Right while the joint moves by less than half the modulus from row to row.
    turns = -np.round(np.diff(values[known], prepend=first) / modulus)
    wraps = int(np.count_nonzero(turns))
    # No reading shows the first turn. The cumulative sum carries this choice to all rows.
    turns[0] = -np.round((first - near) / modulus)
    unwrapped_values = values.copy()
    unwrapped_values[known] = values[known] + modulus * np.cumsum(turns)
    if wraps:
        note(f"wraps at {modulus:g}, {counted(wraps, 'time')}", "counted on")
    if turns[0]:
        begins = first + modulus * turns[0]
        seen = f"begins at {first:.6g} of {modulus:g}"
        action = (
            f"taken for {begins:.6g}, in the turn nearest to {near:.6g}; begins_at names another"
        )
        note(seen, action)
    return unwrapped_values


def note_guessed_turns(
    time_s: NDArray, unwrapped_values: NDArray, modulus: float, note: Note = unnoted
) -> None:
    """Report the gaps after which a counter may be in another turn than was assumed.

    At the fastest speed of the log, the counter moves by more than half of its modulus there.

    Parameters
    ----------
    time_s : (n,) array
        Times, s, NaN where missing.
    unwrapped_values : (n,) array
        Readings that go on across wraparounds, NaN where missing.
    modulus : float
        Reading at which the counter starts again at 0.
    note : callable
        Takes what is reported about the counter.
    """
    known = np.isfinite(time_s) & np.isfinite(unwrapped_values)
    time, rows = np.unique(time_s[known], return_index=True)
    if len(time) < 4:
        return
    steps, is_gap = np.diff(time), missing_samples(time) > 0
    speeds = (np.diff(unwrapped_values[known][rows]) / steps)[~is_gap]
    if not is_gap.any() or not len(speeds):
        return
    # A median of three tolerates an outlier, which is a step there and one back.
    fastest = float(np.max(np.abs(median_filter(speeds, 3, mode="nearest"))))
    guessed = is_gap & (fastest * steps > 0.5 * modulus)
    if guessed.any():
        seen = (
            f"may move by more than half of {modulus:g} in"
            f" {counted(int(guessed.sum()), 'gap')}, the first at {time[:-1][guessed][0]:.6g} s"
        )
        note(seen, "the turn after each is a guess; set span_s so that no [[recording]] has one")


def full_at(values: NDArray, turns: Iterable[float]) -> float | None:
    """Return the modulus at which a counter wraps around; None where it does not.

    Unwrapped at the modulus, the largest steps must become as small as all others.

    Parameters
    ----------
    values : (n,) array
        Readings, NaN where missing.
    turns : iterable of float
        Moduli that are tried, in addition to those of registers where readings are whole.

    Returns
    -------
    float or None
        The smallest modulus that fits.
    """
    known = values[np.isfinite(values)]
    steps = np.abs(np.diff(known))
    # A wraparound crosses nearly the whole range of readings, motion from row to row does not.
    far = steps > 0.5 * np.ptp(known) if len(known) else np.zeros(0, dtype=bool)
    if not far.any() or far.all():
        return None
    # Of nearly all steps: a few lead across rows that are missing.
    moved = 1.5 * float(np.quantile(steps[~far], 0.99))
    reach = float(np.ptp(known))
    whole = bool(np.all(known == np.round(known)))
    for modulus in sorted((*turns, *(REGISTERS if whole else ()))):
        # Motion must be slow against the modulus, or its own steps look like wraparounds. The
        # median tolerates single outliers. No reading of a counter lies beyond its modulus.
        if (
            moved < 0.25 * modulus
            and np.median(np.abs(steps[far] - modulus)) <= moved
            and reach <= modulus + moved
        ):
            return modulus
    return None


def sawtooth(values: NDArray, turns: Iterable[float]) -> float | None:
    """Return the turn within which the readings of a fast shaft stay; None where they leave it.

    It needs no slow rows between two wraparounds, as ``full_at`` does.

    Parameters
    ----------
    values : (n,) array
        Readings, NaN where missing.
    turns : iterable of float
        Readings of a turn.
    """
    known = values[np.isfinite(values)]
    reach = float(np.ptp(known)) if len(known) else 0.0
    largest = float(np.max(np.abs(np.diff(known)), initial=0.0))
    # The tolerance is for rounded readings, such as 360.0 for 359.98.
    return next((turn for turn in turns if reach <= 1.001 * turn and largest > 0.5 * turn), None)
