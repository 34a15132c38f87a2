"""Which encoding the values of a register show, where they are read as plain binary numbers.

Binary values have digits above 9 and words above 9999. A register that never has any is not binary,
unless by chance, which becomes small with each value that could have had one.
"""

from collections.abc import Iterator, Mapping
from math import ceil, isnan
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from pipelines.modbus.counts import count_of, raw_of
from pipelines.settings.rig.register import DIGITS, Register

CHANCE = 1e-4
"""Largest probability that a binary register with decimal digits alone is misjudged."""
LONGEST = 2
"""Registers of the longest values that are judged: a float64 holds all counts of these."""


def decimal_keys(register: Register, values: NDArray) -> dict[str, str | int]:
    """Return the keys of a register with which its values make decimal numbers.

    Parameters
    ----------
    register : Register
        As in the rig file.
    values : (n,) array
        New values in a row, as it reads them, SI units.

    Returns
    -------
    dict
        Values by the rig file's keys; empty where the register is binary, or values are too few.
    """
    if not _is_judged(register):
        return {}
    raw = _raw(register, values)
    shown: list[tuple[float, dict[str, str | int]]] = []
    for keys in _possible_keys(register.type, register.bits):
        decimal = register.model_copy(update={"sign_bit": None, **keys})
        counts = _decoded(decimal, raw)
        if counts is not None and _is_no_chance(decimal, raw):
            shown.append((float(np.abs(np.diff(counts)).sum()), keys))
    # A sign bit may be a digit, too; where it is, values leap.
    _, best = min(shown, key=itemgetter(0), default=(0.0, {}))
    return {key: value for key, value in best.items() if getattr(register, key) != value}


def apart_word(register: Register, values: NDArray, keys: Mapping[str, str | int]) -> int | None:
    """Return the largest low word of values whose two registers are not one number, else None.

    The low word of one number takes all values while the high word changes. One that counts the
    hundredths of a unit, or something else, stays near 0.

    Parameters
    ----------
    register : Register
        As in the rig file.
    values : (n,) array
        New values in a row, as it reads them, SI units.
    keys : dict
        Keys with which they make decimal numbers, if they do: `decimal_keys`.
    """
    decimal = register.model_copy(update=dict(keys))
    if register.counts is None or register.registers != 2 or decimal.encoding == "bcd":
        return None
    scale, offset = register.si
    counts: NDArray | None = np.round((values[np.isfinite(values)] - offset) / scale)
    if keys:
        counts = _decoded(decimal, _raw(register, values))
    if counts is None or len(counts) < 2:
        return None
    high = np.round(counts / decimal.word)
    largest = int(np.abs(counts - high * decimal.word).max())
    # Values in coarse steps leave few low words, and no evidence if they leave one.
    step = int(np.gcd(np.gcd.reduce(np.diff(counts).astype(np.int64)), decimal.word))
    share = min(1.0, (2 * (largest // step) + 1) * step / decimal.word)
    # Set-points leap from one round number to another. A motion passes each boundary between two
    # high words, and each boundary counts once.
    passed = np.abs(np.diff(high)) == 1.0
    boundaries = len(np.unique((high[1:] + high[:-1])[passed]))
    return largest if step < decimal.word and share**boundaries <= CHANCE else None


def written_keys(keys: Mapping[str, str | float]) -> list[str]:
    """Return keys and their values as a rig file has them."""
    return [
        f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value:g}"
        for key, value in keys.items()
    ]


def is_gray(register: Register, values: NDArray) -> bool:
    """Return whether values go on evenly only if their bits are a Gray code, as an encoder's.

    From a count to the next, one bit of a Gray code changes: read as binary, it leaps by a power of
    two. Binary values that are decoded as Gray code leap instead.

    Parameters
    ----------
    register : Register
        As in the rig file.
    values : (n,) array
        New values in a row, as it reads them, SI units.
    """
    # Values that are no coincidence, and the share of the travel that decoding leaves.
    enough, least = 30, 0.5
    if not _is_judged(register) or len(values) <= enough:
        return False
    raw = np.array(_raw(register, values), dtype=np.int64)
    decoded = raw.copy()
    for shift in (1, 2, 4, 8, 16):
        decoded ^= decoded >> shift
    # As binary numbers, the highest is next to the lowest: -1 to 0.
    full = 2**register.bits
    steps = np.diff(raw) % full
    way = float(np.minimum(steps, full - steps).sum())
    return float(np.abs(np.diff(decoded)).sum()) < least * way


def is_half_of_float64(register: Register, values: NDArray) -> bool:
    """Return whether values go on evenly only as the first half of a float64.

    The first two registers of a float64 make a possible float32, about the logarithm of its value.
    It bends at each power of two and leaps over zero, where the float64 goes on as it came. A
    float32 goes on there, and bends as a float64. Friction lets both leap, anywhere.

    Parameters
    ----------
    register : Register
        As in the rig file.
    values : (n,) array
        New values in a row, as it reads them, SI units.
    """
    if register.type != "float32":
        return False
    factor, offset = register.si
    single = ((values[np.isfinite(values)] - offset) / factor).astype(np.float32)
    bits = single.view(np.uint32).astype(np.uint64) << np.uint64(32)
    return _goes_on_as(bits.view(np.float64), bits >> np.uint64(52), single)


def is_float16(register: Register, values: NDArray) -> bool:
    """Return whether values go on evenly only as a float of 16 bits.

    Read as an integer, with or without a sign bit, it is about the logarithm of its value, and
    bends as the first half of a float64 does.

    Parameters
    ----------
    register : Register
        As in the rig file.
    values : (n,) array
        New values in a row, as it reads them, SI units.
    """
    if not _is_judged(register) or register.bits != 16 or register.direction is not None:
        return False
    bits = np.array(_raw(register, values), dtype=np.uint16)
    # Without the leap of a sign bit that is read as a part of a number.
    size = (bits & np.uint16(0x7FFF)).astype(float)
    integer = np.where(bits >> np.uint16(15), -size, size)
    return _goes_on_as(bits.view(np.float16), bits >> np.uint16(10), integer)


def _goes_on_as(floats: NDArray, exponents: NDArray, read: NDArray) -> bool:
    """Return whether floats (n,) go on where their exponents change, and what was read bends."""
    # Powers of two that are passed, and how far off a straight line a value is there, in medians of
    # all, if it bends and if it does not.
    enough, bends, goes_on = 6, 2.5, 1.5
    passed = np.flatnonzero(np.diff(exponents.astype(np.int64)))
    passed = passed[(passed > 0) & (passed < len(read) - 2)]
    if len(passed) < enough or not np.isfinite(floats).all():
        return False
    off_line = [np.abs(np.diff(x.astype(float), 2)) for x in (read, floats)]
    # Between two samples the bend may be nearer to either.
    there = [float(np.median(np.maximum(off[passed - 1], off[passed]))) for off in off_line]
    usual = [float(np.median(np.maximum(off[:-1], off[1:]))) for off in off_line]
    return there[0] > bends * usual[0] and there[1] <= goes_on * usual[1]


def is_low_byte(register: Register, values: NDArray) -> bool:
    """Return whether values go on evenly only if the low byte is a number with a sign of its own.

    Two bytes of two quantities may share a register. Read as one number, they leap by 256 counts
    where the low byte changes its sign, and the high byte does not follow. In one number it does.

    Parameters
    ----------
    register : Register
        As in the rig file.
    values : (n,) array
        New values in a row, as it reads them, SI units.
    """
    # Values that are no coincidence, and the share of the travel that bytes of their own leave.
    enough, least = 30, 0.5
    if not _is_judged(register) or register.bits != 16 or len(values) <= enough:
        return False
    raw = np.array(_raw(register, values), dtype=np.uint16)
    low, high = (raw & np.uint16(0xFF)).astype(np.uint8).view(np.int8), raw >> np.uint16(8)
    # A number passes from its lowest value to its highest, too, if its sign is misread.
    as_number = min(_travel(raw), _travel(raw.view(np.int16)))
    return _travel(low) + 256.0 * _travel(high) < least * as_number


def _travel(values: NDArray) -> float:
    """Return the sum of the magnitudes of all steps of values (n,)."""
    return float(np.abs(np.diff(values.astype(float))).sum())


def _is_judged(register: Register) -> bool:
    """Return whether a register is read as a binary integer that is not too long."""
    is_binary = register.counts is not None and register.encoding == "binary"
    return is_binary and register.registers <= LONGEST


def _raw(register: Register, values: NDArray) -> list[int]:
    """Return the bits of values (n,) as unsigned numbers."""
    scale, offset = register.si
    read = np.round((values[np.isfinite(values)] - offset) / scale).astype(np.int64)
    if register.direction is not None:
        read = np.abs(read)
    return [raw_of(register, count) % 2**register.bits for count in read.tolist()]


def _possible_keys(kind: str, bits: int) -> Iterator[dict[str, str | int]]:
    """Yield what a rig file could say of an integer, the likeliest first."""
    unsigned = f"uint{bits}"
    if bits > 16:
        yield {"encoding": "mod10", "type": kind}
        yield {"encoding": "mod10", "type": f"int{bits}"}
        yield {"encoding": "mod10", "type": unsigned, "sign_bit": bits - 1}
    yield {"encoding": "bcd", "type": unsigned}
    yield {"encoding": "bcd", "type": unsigned, "sign_bit": bits - 1}


def _decoded(register: Register, raw: list[int]) -> NDArray | None:
    """Return the counts (n,) of bits, given as unsigned numbers; None if a digit is not decimal."""
    counts = []
    for one in raw:
        counts.append(count_of(register, register.typed(one)))
        if isnan(counts[-1]):
            return None
    return np.array(counts)


def _is_no_chance(register: Register, raw: list[int]) -> bool:
    """Return whether binary values (n,) would have had a digit that is not decimal."""
    width, base = DIGITS[register.encoding]
    bits = register.bits
    if register.sign_bit is not None:  # a sign's digit is no evidence
        bits = bits - width if register.encoding == "bcd" else register.sign_bit
    share = (2 * base - 1 if register.type.startswith("int") else base) / 2**width
    magnitudes = np.array(raw, dtype=np.int64) % 2**bits
    return bool(share ** _independent(magnitudes, width, bits) <= CHANCE)


def _independent(raw: NDArray, width: int, bits: int) -> int:
    """Return how many values (n,) have a lowest digit that does not follow from the one before.

    It follows from it where the value, as a binary number, changes by less than half of all that
    the digit can be.
    """
    step = int(np.gcd.reduce(np.diff(raw))) if len(raw) > 1 else 0
    if not step:
        return 0
    # Values in coarse steps leave the lowest digits constant, or let them have a few values only.
    constant_bits = (step & -step).bit_length() - 1
    far = 2 ** (width * ceil(constant_bits / width) + width - 1)
    count, last = 0, int(raw[0])
    for value in raw.tolist():
        change = (value - last) % 2**bits
        if min(change, 2**bits - change) >= far:
            count, last = count + 1, value
    return count
