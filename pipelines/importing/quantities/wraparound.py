"""Counters: registers logged without their sign, and readings that start anew at 0 when they are
full."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.finding import Finding, counted

REGISTERS = tuple(2.0**bits for bits in range(8, 33))
"""Where counters of whole numbers are full."""


def signed(values: NDArray, bits: int, where: str, findings: list[Finding]) -> NDArray:
    """Return what a signed register holds, (n,), that was logged as if it had no sign (two's
    complement).

    What no register of so many bits can hold is missing: 4.2949673e9 was a number near 2^32 before
    its last digits were lost, and its sign is known but not its value.
    """
    impossible = (values >= 2.0**bits) | (values < -(2.0 ** (bits - 1)))
    if impossible.any():
        first = values[np.argmax(impossible)]
        seen = (
            f"{counted(int(impossible.sum()), 'row')} that {bits} bits cannot hold, the first"
            f" {first:.10g}"
        )
        findings.append(Finding(where, seen, "taken for missing"))
    negative = values >= 2.0 ** (bits - 1)
    if (negative & ~impossible).any():
        share = np.count_nonzero(negative & ~impossible) / len(values)
        seen = (
            f"a signed register of {bits} bits logged without its sign, {share:.0%} of the rows"
            " below 0"
        )
        findings.append(Finding(where, seen, f"less 2^{bits} there"))
    found = np.where(negative, values - 2.0**bits, values)
    return np.where(impossible, np.nan, found)


def unwrapped(
    values: NDArray, modulus: float, where: str, findings: list[Finding], near: float = 0.0
) -> NDArray:
    """Return a counter (n,) that starts anew at ``modulus`` counted on: no step is larger than half
    of it.

    Which turn it begins in no counter tells: it is the one in which its first reading lies nearest
    to ``near``.
    """
    known = np.isfinite(values)
    if not known.any():
        return values
    first = values[known][0]
    turns = -np.round(np.diff(values[known], prepend=first) / modulus)
    wraps = int(np.count_nonzero(turns))
    turns[0] = -np.round((first - near) / modulus)
    found = values.copy()
    found[known] = values[known] + modulus * np.cumsum(turns)
    if wraps:
        findings.append(
            Finding(where, f"wraps at {modulus:g}, {counted(wraps, 'time')}", "counted on")
        )
    if turns[0]:
        begins = first + modulus * turns[0]
        seen = f"begins at {first:.6g} of {modulus:g}"
        told = (
            f"taken for {begins:.6g}, in the turn nearest to {near:.6g}; begins_at in the map names"
            " another"
        )
        findings.append(Finding(where, seen, told))
    return found


def full_at(values: NDArray, turns: Iterable[float]) -> float | None:
    """Return at which reading a counter (n,) was full that nobody counted on; None where none was.

    It is one of ``turns`` or, of whole numbers, of registers, and with it counted on the steps at
    which the counter starts anew are as small as all others.
    """
    known = values[np.isfinite(values)]
    steps = np.abs(np.diff(known))
    far = steps > 0.5 * np.ptp(known) if len(known) else np.zeros(0, dtype=bool)
    if not far.any() or far.all():
        return None
    moved = 1.5 * float(np.max(steps[~far]))
    whole = bool(np.all(known == np.round(known)))
    return next(
        (
            modulus
            for modulus in sorted((*turns, *(REGISTERS if whole else ())))
            if moved < 0.25 * modulus and np.median(np.abs(steps[far] - modulus)) <= moved
        ),
        None,
    )
