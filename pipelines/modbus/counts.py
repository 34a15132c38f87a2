"""Counts of registers that are not plain binary numbers: decimal digits, and sign bits."""

from math import nan

from pipelines.settings.rig.register import DIGITS, STRUCT_CODES, Register


def count_of(register: Register, raw: int) -> float:
    """Return the count that an integer register has; NaN where a digit of it is not decimal.

    Parameters
    ----------
    register : Register
        Its encoding and sign bit count.
    raw : int
        Its bits, read as a number of its type.
    """
    bit = register.sign_bit
    if register.encoding == "binary":
        return raw if bit is None or raw < 2**bit else 2**bit - raw
    if bit is None:
        return _from_digits(register, raw)
    if register.encoding == "mod10":
        return (
            _from_digits(register, raw) if raw < 2**bit else -_from_digits(register, raw - 2**bit)
        )
    # The digit with the sign bit holds nothing else; makers set that bit alone, or all four.
    first = bit // 4 * 4
    sign, magnitude = raw >> first, _from_digits(register, raw & (2**first - 1))
    if sign not in (0, 2 ** (bit - first), 0xF):
        return nan
    return -magnitude if sign else magnitude


def raw_of(register: Register, count: int) -> int:
    """Return the bits of a count, as a number of the register's type.

    Parameters
    ----------
    register : Register
        Its encoding and sign bit count.
    count : int
        One that it can hold.
    """
    bit = register.sign_bit
    size = count if bit is None else abs(count)
    raw = size if register.encoding == "binary" else _to_digits(register, size)
    return raw + 2**bit if bit is not None and count < 0 else raw


def _from_digits(register: Register, raw: int) -> float:
    """Return the count of digits; those of a signed type have a sign each."""
    width, base = DIGITS[register.encoding]
    count = 0
    for shift in range(register.bits - width, -1, -width):
        digit = raw >> shift & (2**width - 1)
        if not STRUCT_CODES[register.type].isupper() and digit >= 2 ** (width - 1):
            digit -= 2**width
        if abs(digit) >= base:
            return nan
        count = count * base + digit
    return count


def _to_digits(register: Register, count: int) -> int:
    """Return the bits of the digits of a count."""
    width, base = DIGITS[register.encoding]
    raw, rest, shift = 0, abs(count), 0
    while rest:
        rest, digit = divmod(rest, base)
        raw |= (-digit if count < 0 else digit) % 2**width << shift
        shift += width
    return register.typed(raw)
