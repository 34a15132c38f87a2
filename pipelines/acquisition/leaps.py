"""Leaps of a register's values, by a turn or a power of two of counts."""

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import NDArray

from pipelines.settings.rig import Register


def leap(
    register: Register, values: NDArray, of_turn: bool = False, also: Sequence[float] = ()
) -> float | None:
    """Return the counts by which values leap, and go on from there; None where they do not.

    Parameters
    ----------
    register : Register
        As in the rig file.
    values : (n,) array
        In a row, as it reads them, SI units.
    of_turn : bool
        Whether they may leap by a turn, too.
    also : sequence of float
        Counts by which they may leap, too.
    """
    if register.turn or len(values) < 2:
        return None
    per_count = abs(register.si[0])
    counts = values / per_count
    steps = np.abs(np.diff(counts))
    # A leap is half of all that the value does; all else is small against it.
    leaps = steps > 0.5 * np.ptp(counts)
    if not leaps.any() or leaps.all():
        return None
    usual = float(steps[~leaps].max())
    if usual > 0.125 * steps[leaps].min():
        return None
    turn = (2.0 * pi / per_count,) if of_turn else ()
    for full in (*turn, *also, *(2.0**bits for bits in range(8, 33))):
        if (np.abs(steps[leaps] - full) <= 2.0 * usual + 1.0).all():
            return full
    return None


def sign_leap(register: Register, where: str, values: NDArray) -> str | None:
    """Return how values leap where they change their sign, with the keys that mend it.

    Parameters
    ----------
    register : Register
        As in the rig file.
    where : str
        Its place there.
    values : (n,) array
        In a row, as it reads them, SI units.
    """
    if register.encoding == "bcd" and register.sign_bit is None:
        # The sign's bit is the highest of a digit.
        digits = 4 * register.registers
        full = leap(register, values, also=(8.0 * 10.0 ** (digits - 1),))
        if full != 8.0 * 10.0 ** (digits - 1):
            return None
        return (
            f"leaps by {full:.0f} counts where it changes its sign: set {where}.sign_bit ="
            f" {register.bits - 1}"
        )
    bits = register.bits
    if bits > 32 or register.encoding != "binary" or register.counts is None:
        return None
    full = leap(register, values)
    has_sign = register.sign_bit is not None or register.direction is not None
    if has_sign and full in (2.0**bits, 2.0 ** (bits - 1)):
        key = "direction" if register.sign_bit is None else "sign_bit"
        remedy = (
            f'it is a number of two\'s complement; set {where}.type = "int{bits}" and leave {key}'
            " out"
        )
    elif full == 2.0**bits and register.is_unsigned:
        remedy = f'negative values are read as large ones; set {where}.type = "int{bits}"'
    elif full == 2.0**bits:
        middle = -(2.0 ** (bits - 1)) * register.scale
        remedy = (
            f'it counts from the middle of its range; set {where}.type = "uint{bits}" and offset ='
            f" {middle:g}. Or it is the low word of a longer value"
        )
    elif full == 2.0 ** (bits - 1):
        remedy = (
            f'it is a magnitude with a sign bit; set {where}.type = "uint{bits}" and sign_bit ='
            f" {bits - 1}"
            + (". Or it is a float of 16 bits, which no key reads" if bits == 16 else "")
        )
    elif full is not None and full < 2.0 ** (bits - 1) and _is_unsigned_of(full, register, values):
        remedy = (
            f"negative values of {np.log2(full):.0f} bits are read as large ones; let the device"
            f" fill all {bits} bits with their sign, as no key reads a shorter number"
        )
    else:
        return None
    return f"leaps by {full:.0f} counts where it changes its sign: {remedy}"


def _is_unsigned_of(full: float, register: Register, values: NDArray) -> bool:
    """Return whether values fill a shorter register from both of its ends, without a sign."""
    counts = (values[np.isfinite(values)] - register.si[1]) / register.si[0]
    return bool(counts.min() > -0.5 and counts.max() < full)
