"""A block of a device's Modbus registers, read and written as SI values."""

import struct
from collections.abc import Mapping, Sequence
from operator import itemgetter

from pipelines.modbus.counts import count_of, raw_of
from pipelines.settings.rig import Register
from pipelines.settings.rig.register import STRUCT_CODES

# Step of a slice: a little-endian order is the standard's big-endian one, reversed.
_STEP = {"big": 1, "little": -1}


class Block:
    """Registers of one exchange, from the lowest address to the highest."""

    def __init__(self, registers: Mapping[str, Register]) -> None:
        self.registers = dict(registers)
        self.names = tuple(registers)
        spans = [span for r in registers.values() for span in r.spans]
        self.address = min(span.start for span in spans)
        self.count = max(span.stop for span in spans) - self.address
        # Bytes are picked in the order of one big-endian structure of all values.
        self._places = [place for r in registers.values() for place in self._bytes(r)]
        self._pick = itemgetter(*self._places)
        self._words_format = struct.Struct(f">{self.count}H")
        self._values_format = struct.Struct(
            ">" + "".join(STRUCT_CODES[r.type] for r in registers.values())
        )
        self._scales = [r.si for r in registers.values()]
        self._ranges = [r.counts for r in registers.values()]
        # Few registers are encoded: the others must cost nothing in the loop of a run.
        self._encoded = [
            (k, name, r)
            for k, (name, r) in enumerate(registers.items())
            if {"encoding", "sign_bit"} & set(r.encoding_keys)
        ]
        self._directions = [
            (name, r.direction, r.direction.address - self.address)
            for name, r in registers.items()
            if r.direction is not None
        ]

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
            SI value by quantity; NaN where its digits are not decimal.
        """
        raw = self._values_format.unpack(bytes(self._pick(self._words_format.pack(*words))))
        values = {
            name: value * scale + offset
            for name, value, (scale, offset) in zip(self.names, raw, self._scales, strict=True)
        }
        for k, name, register in self._encoded:
            scale, offset = self._scales[k]
            values[name] = count_of(register, raw[k]) * scale + offset
        for name, direction, place in self._directions:
            if words[place] & direction.mask == direction.negative:
                offset = self.registers[name].si[1]
                values[name] = 2.0 * offset - values[name]
        return values

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
        for name, (scale, offset), limits in zip(
            self.names, self._scales, self._ranges, strict=True
        ):
            # A count beyond the range would raise an error in `struct`, so it saturates. A float is
            # not rounded.
            value = (values[name] - offset) / scale
            count = value if limits is None else min(max(round(value), limits[0]), limits[1])
            raw.append(count if self.registers[name].direction is None else abs(count))
        for k, _, register in self._encoded:
            raw[k] = raw_of(register, int(raw[k]))
        # Registers without a name are written as 0; a drive's block has none (`DriveMap`).
        packed = bytearray(2 * self.count)
        for place, byte in zip(self._places, self._values_format.pack(*raw), strict=True):
            packed[place] = byte
        words = list(self._words_format.unpack(packed))
        for name, direction, place in self._directions:
            scale, offset = self.registers[name].si
            positive = 0 if direction.negative else direction.mask
            sign = direction.negative if (values[name] - offset) / scale < 0.0 else positive
            words[place] = words[place] & ~direction.mask | sign
        return words

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
