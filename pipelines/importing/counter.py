"""Counters: registers logged without their sign, and readings that start anew at 0 when they are full."""

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.finding import Finding, counted


def signed(values: NDArray, bits: int, where: str, findings: list[Finding]) -> NDArray:
    """Return what a signed register holds, (n,), that was logged as if it had no sign (two's complement).

    What no register of so many bits can hold is missing: 4.2949673e9 was a number near 2^32 before its last digits
    were lost, and its sign is known but not its value.
    """
    impossible = (values >= 2.0**bits) | (values < -(2.0 ** (bits - 1)))
    if impossible.any():
        first = values[np.argmax(impossible)]
        seen = f"{counted(int(impossible.sum()), 'row')} that {bits} bits cannot hold, the first {first:.10g}"
        findings.append(Finding(where, seen, "taken for missing"))
    negative = values >= 2.0 ** (bits - 1)
    if (negative & ~impossible).any():
        share = np.count_nonzero(negative & ~impossible) / len(values)
        seen = f"a signed register of {bits} bits logged without its sign, {share:.0%} of the rows below 0"
        findings.append(Finding(where, seen, f"less 2^{bits} there"))
    found = np.where(negative, values - 2.0**bits, values)
    return np.where(impossible, np.nan, found)


def unwrapped(values: NDArray, modulus: float, where: str, findings: list[Finding]) -> NDArray:
    """Return a counter (n,) that starts anew at ``modulus`` counted on: no step is larger than half of it."""
    known = np.isfinite(values)
    steps = np.diff(values[known])
    turns = -np.round(steps / modulus)
    wraps = int(np.count_nonzero(turns))
    if not wraps:
        return values
    findings.append(Finding(where, f"wraps at {modulus:g}, {counted(wraps, 'time')}", "counted on"))
    found = values.copy()
    found[known] = values[known] + modulus * np.concatenate([[0.0], np.cumsum(turns)])
    return found
