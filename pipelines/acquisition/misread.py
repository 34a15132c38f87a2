"""What a channel's values show to be wrong, though each of them is possible."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.encodings import (
    apart_word,
    decimal_keys,
    is_float16,
    is_gray,
    is_half_of_float64,
    is_low_byte,
    written_keys,
)
from pipelines.acquisition.leaps import sign_leap
from pipelines.settings.rig import Register
from pipelines.signals.cut_off import cut_off_at
from pipelines.signals.filler import fill_value
from pipelines.signals.folded import is_folded, is_folded_angle
from pipelines.signals.held import are_held, new_values
from pipelines.signals.leaping import leaps
from pipelines.signals.rescaled import is_rescaled
from pipelines.signals.sampling import sample_rate


def misread(quantity: str, register: Register, where: str, values: NDArray) -> Iterator[str]:
    """Yield how the values of a register are misread, and the keys that mend it.

    Parameters
    ----------
    quantity : str
        Which the register holds.
    register : Register
        As in the rig file.
    where : str
        Its place there.
    values : (n,) array
        In a row, as it reads them, SI units; NaN where missing.
    """
    new = values[new_values(values)]
    # An angle may leap because it starts again after a turn.
    may_start_again = quantity in ("angle", "reference") and register.encoding == "binary"
    of_bits = _wrong_type(register, where, new) or (
        None if may_start_again else _other_sign(register, where, values)
    )
    # Nothing else is to be seen in values of which the bits are misread.
    if of_bits is not None:
        yield of_bits
        return
    if not register.turn and (code := _code(register, new)) is not None:
        yield (
            f"a value is often exactly {code * register.si[0] + register.si[1]:.6g} (a raw"
            f" {code:g}), far from all others: a code for missing readings? See the manual; let"
            " the device repeat its last reading, or answer with an exception"
        )
    elif not register.turn and (rows := _at_an_end(register, values)):
        yield (
            f"{rows} of {len(values)} values are at the end of their register, where larger ones"
            " are cut off; let the device write coarser units, or two registers"
        )
    elif quantity in ("torque", "current") and (ends := cut_off_at(values)):
        yield (
            f"values come to {' and '.join(f'{end:.4g}' for end in ends)} at full slope and stay"
            " there, so larger ones are cut off; let the device or its sensor have a larger range."
            " If the drive limits its torque there, they are right"
        )
    if is_gray(register, new):
        yield (
            "values leap, and go on evenly as a Gray code; let the device write binary numbers, as"
            " no key reads a Gray code"
        )
    elif quantity in ("torque", "current") and _is_about_middle(register, new):
        yield (
            f"values lie about the middle of their register; if it stands for 0, set {where}.offset"
            f" = {-_middle(register) * register.scale:g}"
        )
    elif quantity in ("torque", "current") and is_rescaled(new - register.si[1]):
        yield (
            "values leap by a factor of ten, and back, as those of a display with a decimal point"
            " that moves; fix it in the device"
        )
    elif quantity in ("torque", "current") and is_folded(new - register.si[1]):
        remedy = (
            f"{where}.direction is the sign of something else, or comes late"
            if register.direction is not None
            else f"set {where}.direction to the register that has it, or sign_bit"
        )
        yield (
            "values turn round at 0 as those of a magnitude do, so that their sign is missing;"
            f" {remedy}"
        )
    elif quantity == "angle" and not register.turn and is_folded_angle(new - register.si[1]):
        yield (
            "values turn round at 0 as those of a magnitude do, so that their sign is missing; let"
            f" the device write it, or set {where}.sign_bit. If the joint rebounds from a stop"
            " there, they are right"
        )


def _code(register: Register, new: NDArray) -> float | None:
    """Return the raw value that stands for missing readings among new values (n,), if one does."""
    # Fewest different values: a device at rest has a few, and a step of noise lies far from them.
    enough = 16
    value = fill_value(new)
    # A raw 0 is no code: it is that of a drive that is off.
    if value is None or register.counts is None or len(np.unique(new)) <= enough:
        return None
    raw = round((value - register.si[1]) / register.si[0])
    return raw or None


def _wrong_type(register: Register, where: str, new: NDArray) -> str | None:
    """Return of which encoding or type new values (n,) are, if it is not that of the register."""
    keys = decimal_keys(register, new)
    largest = apart_word(register, new, keys)
    if largest is not None:
        return (
            f"the low word stays within {largest} counts of 0 while the high word changes, so the"
            " two registers are not one number. They may be a unit and its hundredths, or two"
            " quantities; let the device write one number, or read each word alone"
        )
    if keys:
        written = " and ".join(written_keys(keys))
        return f"all digits are decimal, so the register is not binary; set {where}.{written}"
    if is_half_of_float64(register, new):
        return (
            "values bend at each power of two, and go on evenly as the first half of a float64; set"
            f' {where}.type = "float64", and look at the other values of this device'
        )
    if is_float16(register, new):
        return (
            "values bend at each power of two, and go on evenly as floats of 16 bits; let the"
            " device write an integer or a float32, as no key reads a float16"
        )
    return None


def _other_sign(register: Register, where: str, values: NDArray) -> str | None:
    """Return how values (n,) leap where they change their sign."""
    if is_low_byte(register, values[new_values(values)]):
        return (
            "values leap by 256 counts, and go on evenly if the low byte is a number with a sign of"
            " its own, and the high byte something else; let the device write each to a register,"
            " as no key reads a byte"
        )
    return sign_leap(register, where, values)


def _is_about_middle(register: Register, values: NDArray) -> bool:
    """Return whether values of one sign lie on both sides of the middle of their register."""
    # Share of the register that they fill at most: else they lie all over it.
    narrow = 0.125
    if register.counts is None or not register.is_unsigned or register.offset != 0.0:
        return False
    size, middle = np.abs(values / register.si[0]), _middle(register)
    if len(size) < 2 or register.encoding != "binary":
        return False
    return bool(size.min() < middle < size.max() and np.ptp(size) < 2.0 * narrow * middle)


def _middle(register: Register) -> float:
    """Return the count in the middle of an unsigned register."""
    return 0.0 if register.counts is None else 0.5 * (register.counts[1] + 1)


def held(time_s: NDArray, values: NDArray) -> Iterator[str]:
    """Yield that new values come less often than rows, as in the copy that a gateway keeps.

    Each value is then true at some row before.

    Parameters
    ----------
    time_s : (n,) array
        Of each row, s.
    values : (n,) array
        In any unit, NaN where missing.
    """
    if are_held(values):
        rate_hz = sample_rate(time_s[new_values(values)])
        yield (
            f"new values come at {rate_hz:.3g} Hz, and rows at {sample_rate(time_s):.3g} Hz; let"
            " the device or gateway renew its registers faster, or record at that rate"
        )


def leaping(time_s: NDArray, values: NDArray) -> Iterator[str]:
    """Yield that an angle leaps, as after a gateway repeated old values of a silent device.

    Parameters
    ----------
    time_s : (n,) array
        Of each row, s.
    values : (n,) array
        In any unit, NaN where missing.
    """
    known = np.isfinite(values)
    time_s, values = time_s[known], values[known]
    rows = leaps(time_s, values)
    if len(rows):
        yield (
            f"values leap, first by {abs(values[rows[0]] - values[rows[0] - 1]):.4g} at"
            f" {time_s[rows[0]]:.4g} s, as no mass can; a gateway may have repeated old values"
            " until then; let it answer with an exception where a device is silent"
        )


def _at_an_end(register: Register, values: NDArray) -> int:
    """Return how many values are the largest, or smallest, that a register can hold."""
    low, high = register.span
    ends = [low, high]
    if register.is_unsigned:  # a raw 0 is no end that cuts off, but where an idle value lies
        ends = [high if register.scale > 0.0 else low]
    at_an_end = [np.isclose(values, end, rtol=1e-9) for end in ends if np.isfinite(end)]
    return int(np.count_nonzero(np.any(at_an_end, axis=0))) if at_an_end else 0
