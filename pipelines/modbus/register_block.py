"""A block of a device's Modbus registers, read and written as SI values."""

import struct
from collections.abc import Mapping, Sequence
from operator import itemgetter

from pipelines.settings.rig import Register
from pipelines.settings.rig.register import STRUCT_CODES

# Step of a slice: a little-endian order is the standard's big-endian one, reversed.
_STEP = {"big": 1, "little": -1}


class Block:
    """Registers of one exchange, from the lowest address to the highest."""

    def __init__(self, registers: Mapping[str, Register]) -> None:
        self.registers = dict(registers)
        self.names = tuple(registers)
        self.address = min(r.address for r in registers.values())
        self.count = max(r.address + r.registers for r in registers.values()) - self.address
        # Bytes are picked in the order of one big-endian structure of all values.
        self._places = [place for r in registers.values() for place in self._bytes(r)]
        self._pick = itemgetter(*self._places)
        self._words_format = struct.Struct(f">{self.count}H")
        self._values_format = struct.Struct(
            ">" + "".join(STRUCT_CODES[r.type] for r in registers.values())
        )
        self._scales = [r.si for r in registers.values()]
        self._sign_bits = [r.sign_bit for r in registers.values()]
        self._ranges = [r.counts for r in registers.values()]

    def _bytes(self, register: Register) -> list[int]:
        first = register.address - self.address
        words = list(range(first, first + register.registers))[:: _STEP[register.word_order]]
        return [2 * word + byte for word in words for byte in (0, 1)[:: _STEP[register.byte_order]]]

    def decode(self, words: Sequence[int]) -> dict[str, float]:
        """Return the values of a block.

        Parameters
        ----------
        words : sequence of int
            ``count`` words, read from ``address`` on.

        Returns
        -------
        dict
            SI value by quantity.
        """
        raw = self._values_format.unpack(bytes(self._pick(self._words_format.pack(*words))))
        return {
            name: (value if bit is None else _signed(value, bit)) * scale + offset
            for name, value, bit, (scale, offset) in zip(
                self.names, raw, self._sign_bits, self._scales, strict=True
            )
        }

    def encode(self, values: Mapping[str, float]) -> list[int]:
        """Return the words of a block; values beyond a register's range saturate.

        Parameters
        ----------
        values : mapping
            SI value by quantity.

        Returns
        -------
        list of int
            ``count`` words.
        """
        raw = []
        for name, bit, (scale, offset), limits in zip(
            self.names, self._sign_bits, self._scales, self._ranges, strict=True
        ):
            # A count beyond the range would raise an error in `struct`, so it saturates. A float is
            # not rounded.
            value = (values[name] - offset) / scale
            count = value if limits is None else min(max(round(value), limits[0]), limits[1])
            raw.append(2**bit - count if bit is not None and count < 0 else count)
        # Registers without a name are written as 0; a drive's block has none (`DriveMap`).
        packed = bytearray(2 * self.count)
        for place, byte in zip(self._places, self._values_format.pack(*raw), strict=True):
            packed[place] = byte
        return list(self._words_format.unpack(packed))

    def only(self, name: str) -> "Block":
        """Return the block of one quantity."""
        return Block({name: self.registers[name]})

    def modulus(self, name: str) -> float:
        """Return the value at which an unsigned register wraps around to 0.

        Parameters
        ----------
        name : str
            The quantity.

        Returns
        -------
        float
            SI units; 0 for other registers.
        """
        # Unsigned registers alone wrap around: 0 follows their greatest count.
        register = self.registers[name]
        limits = register.counts
        return (limits[1] + 1) * register.si[0] if limits and limits[0] == 0 else 0.0


def _signed(raw: int, bit: int) -> int:
    """Return the count of a register that holds a magnitude, and a bit that is set below zero."""
    return raw if raw < 2**bit else 2**bit - raw
