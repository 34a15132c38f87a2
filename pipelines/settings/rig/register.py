"""A register: where a value lies in a device, and how its bits are read."""

import struct
from math import inf
from typing import Literal, Self, get_args

from pydantic import Field, model_validator

from pipelines.settings import units
from pipelines.settings.base import Settings

RegisterType = Literal[
    "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"
]
STRUCT_CODES: dict[RegisterType, str] = {
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
"""Code of each type in Python's ``struct``, which has its size and sign; a capital is unsigned.

The number of bits is in the type's name, and may be less than that of its registers. A count of 24
bits in two registers is read as one of 32, which is right if the device extends its sign.
"""
Encoding = Literal["binary", "mod10", "bcd"]
DIGITS: dict[Encoding, tuple[int, int]] = {"mod10": (16, 10_000), "bcd": (4, 10)}
"""Bits and base of each digit of a decimal encoding."""
WORD = 65536
"""Counts that one of a binary value's high word is worth."""
REGISTERS = {kind: struct.calcsize(f">{code}") // 2 for kind, code in STRUCT_CODES.items()}
"""Registers of 16 bits that a value takes."""

Unit = Literal[
    "1",
    "rad",
    "mrad",
    "deg",
    "rad/s",
    "deg/s",
    "rpm",
    "A",
    "mA",
    "N·m",
    "mN·m",
    "N",
    "kN",
    "°C",
    "s",
    "ms",
    "us",
]

UNITS = {"1": 1.0} | {unit: units.UNITS[unit].factor for unit in get_args(Unit) if unit != "1"}
"""SI value of one of each unit that a register can hold."""

DIMENSION = {
    "sequence": ("1",),
    "status": ("1",),
    "control": ("1",),
    "heartbeat": ("1",),
    "time": ("s", "ms", "us"),
    "angle": ("rad", "mrad", "deg"),
    "reference": ("rad", "mrad", "deg"),
    "velocity": ("rad/s", "deg/s", "rpm"),
    "current": ("A", "mA"),
    "torque": ("N·m", "mN·m"),
    "temperature": ("°C",),
    "force_x": ("N", "kN"),
    "force_y": ("N", "kN"),
    "force_z": ("N", "kN"),
}
"""Units that a register of each quantity may have, the SI unit first."""


class Direction(Settings):
    """A register that has the sign of a magnitude in another one."""

    address: int = Field(ge=0, le=65535, description="Address of the register.")
    mask: int = Field(0xFFFF, ge=1, le=65535, description="Bits of it that have the sign.")
    negative: int = Field(ge=0, le=65535, description="Value of these bits below zero.")

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if self.negative & ~self.mask:
            raise ValueError(
                f"negative: found 0x{self.negative:04X}, expected bits of mask 0x{self.mask:04X}"
                " only; correct one of them"
            )
        return self


class Register(Settings):
    """Where a value lies and how its bits are read: value = raw x scale + offset, in ``unit``."""

    address: int = Field(ge=0, le=65535, description="Of its first register, counted from 0.")
    type: RegisterType = Field(description="How the bits are to be read.")
    word_order: Literal["big", "little"] = Field("big", description="Order of its registers.")
    byte_order: Literal["big", "little"] = Field("big", description="Order of bytes in each.")
    scale: float = Field(1.0, description="Units per count; negative turns the sign.")
    offset: float = Field(0.0, ge=-1e12, le=1e12, description="Value at a raw 0, in the unit.")
    unit: Unit = Field("1", description="Unit of the scaled value.")
    encoding: Encoding = Field(
        "binary", description="mod10: 4 decimal digits a register; bcd: one each 4 bits."
    )
    sign_bit: int | None = Field(
        None, ge=3, le=63, description="Bit that is set below zero, where the rest is a magnitude."
    )
    direction: Direction | None = Field(
        None, description="Register with the sign, where this one has a magnitude."
    )

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if self.scale == 0.0:
            raise ValueError("scale: found 0, expected units per count")
        if self.sign_bit is not None and self.sign_bit >= self._unsigned_bits:
            raise ValueError(
                f"sign_bit: found {self.sign_bit} of a register of type {self.type}, expected a bit"
                " of an unsigned type; set type to uint16, uint32 or uint64"
            )
        self._check_encoding()
        self._check_direction()
        if self.address + self.registers > 65536:
            raise ValueError(
                f"address: found {self.address}, but a {self.type} there ends beyond address 65535"
            )
        return self

    def _check_encoding(self) -> None:
        """Refuse types and sign bits that an encoding by digits does not have."""
        if self.encoding == "binary":
            return
        if self.type.startswith("float") or (self.encoding == "bcd" and not self._unsigned_bits):
            expected = "an unsigned type" if self.encoding == "bcd" else "an integer"
            raise ValueError(
                f"encoding: found {self.encoding} with type {self.type}, expected {expected}"
            )
        first = self._unsigned_bits - (4 if self.encoding == "bcd" else 1)
        if self.sign_bit is not None and self.sign_bit < first:
            raise ValueError(
                f"sign_bit: found {self.sign_bit}, expected {first} or more with {self.encoding}"
                f" and {self.type}, as the bits below it are digits"
            )

    def _check_direction(self) -> None:
        """Refuse a direction of a value that has a sign already, or that is part of it."""
        if self.direction is None:
            return
        if not self._unsigned_bits or self.sign_bit is not None:
            raise ValueError(
                "direction: found with a value that has a sign of its own, expected a magnitude;"
                " set type to uint16, uint32 or uint64 and leave sign_bit out"
            )
        if self.direction.address in self.addresses:
            raise ValueError(
                f"direction.address: found {self.direction.address}, a register of the value"
                " itself; use sign_bit"
            )

    @property
    def registers(self) -> int:
        """How many registers of 16 bits it takes."""
        return REGISTERS[self.type]

    @property
    def addresses(self) -> range:
        """Addresses of its registers."""
        return range(self.address, self.address + self.registers)

    @property
    def spans(self) -> tuple[range, ...]:
        """Addresses of its registers, and of the one with its sign where that is another."""
        if self.direction is None:
            return (self.addresses,)
        return self.addresses, range(self.direction.address, self.direction.address + 1)

    @property
    def si(self) -> tuple[float, float]:
        """SI units per count, and the SI value at a raw 0."""
        return self.scale * UNITS[self.unit], self.offset * UNITS[self.unit]

    @property
    def step(self) -> float:
        """Distance between the SI values of neighbouring counts; 0 for a float."""
        return 0.0 if self.counts is None else abs(self.si[0])

    @property
    def turn(self) -> float:
        """SI value after which it starts again at 0, though its type could go on; else 0."""
        return 0.0

    @property
    def is_unsigned(self) -> bool:
        """Whether it is a count from 0, which wraps around."""
        return self._unsigned_bits > 0 and self.sign_bit is None and self.direction is None

    @property
    def encoding_keys(self) -> tuple[str, ...]:
        """Its keys that make it other than a plain number of its type."""
        given = {
            "encoding": self.encoding != "binary",
            "sign_bit": self.sign_bit is not None,
            "direction": self.direction is not None,
        }
        return tuple(key for key, is_given in given.items() if is_given)

    @property
    def bits(self) -> int:
        """Bits of its registers."""
        return 16 * self.registers

    def typed(self, raw: int) -> int:
        """Return its bits, an unsigned number, as a number of its type."""
        is_signed = STRUCT_CODES[self.type].islower()
        return raw - 2**self.bits if is_signed and raw >= 2 ** (self.bits - 1) else raw

    @property
    def word(self) -> int:
        """Counts that one of its high word is worth."""
        return WORD if self.encoding == "binary" else 10_000

    @property
    def _unsigned_bits(self) -> int:
        """The bits of an unsigned type; 0 for others."""
        return int(self.type.removeprefix("uint")) if STRUCT_CODES[self.type].isupper() else 0

    @property
    def counts(self) -> tuple[int, int] | None:
        """The least and the greatest count of an integer; None for a float."""
        if STRUCT_CODES[self.type] in "fd":
            return None
        bits = int(self.type.removeprefix("u").removeprefix("int"))
        if self.encoding == "binary" and not self._unsigned_bits:
            return -(2 ** (bits - 1)), 2 ** (bits - 1) - 1
        if self.encoding == "binary":
            greatest = 2 ** (bits if self.sign_bit is None else self.sign_bit) - 1
        else:
            width, base = DIGITS[self.encoding]
            # A sign takes a whole digit of BCD, and of a word one bit that its digits do not need.
            digits = bits // width - (self.encoding == "bcd" and self.sign_bit is not None)
            greatest = base**digits - 1
        return 0 if self.is_unsigned else -greatest, greatest

    @property
    def span(self) -> tuple[float, float]:
        """The least and the greatest SI value that it can represent; infinite for a float."""
        if self.counts is None:
            return -inf, inf
        scale, offset = self.si
        # A negative scale turns the order of the ends round.
        low, high = sorted(count * scale + offset for count in self.counts)
        return low, high

    def holds(self, low: float, high: float) -> bool:
        """Return whether it can represent every value of a range.

        Parameters
        ----------
        low, high : float
            SI units.
        """
        if self.counts is None:
            return True
        scale, offset = self.si
        least, greatest = self.counts
        # Rounded as a value is when it is written.
        return all(least <= round((value - offset) / scale) <= greatest for value in (low, high))
