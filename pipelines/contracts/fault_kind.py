"""Kinds of faults of acquisition, by which a user overrules them."""

from enum import StrEnum


class FaultKind(StrEnum):
    """What is wrong with a recording."""

    CLOCK = "clock"
    STALE = "stale"
    STUCK = "stuck"
    SATURATED = "saturated"
    COPY = "copy"
    UNIT = "unit"
    SIGN = "sign"
    SWAP = "swap"
    SIGN_BIT = "sign_bit"
    CUFFS = "cuffs"
