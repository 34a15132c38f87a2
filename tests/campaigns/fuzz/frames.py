"""Modbus TCP and RTU frames, right and wrong in every way that a grammar of them can be."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random

HANG_UP = None
"""In a script: close the connection here."""

Script = list[bytes | float | None]
"""What is sent, one after the other; a float is a pause, s."""

SPECIAL = [
    struct.pack(">f", value)
    for value in (float("nan"), float("inf"), float("-inf"), 3.4e38, -3.4e38, 1e-45, 0.0)
] + [b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\x80\x00\x00\x00", b"\x00\x00\x00\x01"]
"""What is odd as a float or as an integer."""


@dataclass(frozen=True)
class Frame:
    """One frame; each part may be a lie."""

    transaction: int
    unit: int
    body: bytes
    """Function code and what follows."""
    protocol: int = 0
    length: int | None = None
    """What the head says; None for the truth."""
    rtu: bool = False
    """Whether unit and body travel alone, with a checksum; a lie about the rest is one about
    that."""

    def __bytes__(self) -> bytes:
        if self.rtu:
            data = bytes([self.unit]) + self.body
            return data + (crc(data) ^ self.protocol ^ (self.length or 0)).to_bytes(2, "little")
        length = len(self.body) + 1 if self.length is None else self.length
        return struct.pack(">HHHB", self.transaction, self.protocol, length, self.unit) + self.body


def crc(data: bytes) -> int:
    """Return the checksum of an RTU frame ("Modbus over serial line" V1.02, 6.2.2)."""
    remainder = 0xFFFF
    for byte in data:
        remainder ^= byte
        for _ in range(8):
            remainder = remainder >> 1 ^ (0xA001 if remainder & 1 else 0)
    return remainder


def parsed(data: bytes) -> Frame:
    """Return a whole Modbus TCP frame as its parts."""
    transaction, protocol, length, unit = struct.unpack(">HHHB", data[:7])
    return Frame(transaction, unit, data[7:], protocol, length)


def words(rng: Random, count: int) -> bytes:
    """Return so many registers, some of them what no honest device holds."""
    if rng.random() < 0.5:
        return rng.randbytes(2 * count)
    values = b"".join(rng.choice((*SPECIAL, rng.randbytes(4))) for _ in range(count // 2 + 1))
    return values[: 2 * count]


def _flipped(rng: Random, data: bytes) -> bytes:
    flipped = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        flipped[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(flipped)


def _other_body(rng: Random, frame: Frame) -> bytes:
    function = rng.choice(
        (1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 17, 20, 21, 22, 23, 24, 43, rng.randrange(256))
    )
    return bytes([function]) + rng.choice((frame.body[1:], rng.randbytes(rng.randrange(40))))


def _other_count(rng: Random, frame: Frame) -> bytes:
    body = bytearray(frame.body)
    if len(body) > 1:
        body[1] = rng.choice(
            (0, 1, body[1] - 1 & 255, body[1] + 1 & 255, body[1] - 2 & 255, 255, rng.randrange(256))
        )
    return bytes(body)


def _pieces(rng: Random, data: bytes) -> Script:
    """Cut data into what arrives one after the other."""
    cuts = sorted(rng.randrange(len(data) + 1) for _ in range(rng.randint(1, 4)))
    return [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True)]


Mutation = Callable[[Random, Frame], Script]

MUTATIONS: dict[str, Mutation] = {
    "right": lambda rng, f: [bytes(f)],
    "in pieces": lambda rng, f: _pieces(rng, bytes(f)),
    "bits flipped": lambda rng, f: [_flipped(rng, bytes(f))],
    "cut": lambda rng, f: [bytes(f)[: rng.randrange(len(bytes(f)))]],
    "grown": lambda rng, f: [bytes(f) + rng.randbytes(rng.randint(1, 400))],
    "body grown, length true": lambda rng, f: [
        bytes(replace(f, body=f.body + rng.randbytes(rng.randint(1, 9))))
    ],
    "body cut, length true": lambda rng, f: [
        bytes(replace(f, body=f.body[: rng.randrange(len(f.body) + 1)]))
    ],
    "length": lambda rng, f: [
        bytes(replace(f, length=rng.choice((0, 1, 2, 3, 254, 255, 256, 0x7FFF, 0xFFFF))))
    ],
    "byte count": lambda rng, f: [bytes(replace(f, body=_other_count(rng, f)))],
    "function": lambda rng, f: [bytes(replace(f, body=_other_body(rng, f)))],
    "exception": lambda rng, f: [
        bytes(replace(f, body=bytes([f.body[0] | 0x80, rng.randrange(256)])))
    ],
    "exception of another size": lambda rng, f: [
        bytes(replace(f, body=bytes([rng.randrange(128, 256)]) + rng.randbytes(rng.randrange(6))))
    ],
    "transaction": lambda rng, f: [
        bytes(
            replace(
                f,
                transaction=rng.choice(
                    (0, f.transaction + 1 & 0xFFFF, 0xFFFF, rng.randrange(65536))
                ),
            )
        )
    ],
    "protocol": lambda rng, f: [bytes(replace(f, protocol=rng.randrange(1, 65536)))],
    "unit": lambda rng, f: [bytes(replace(f, unit=rng.randrange(256)))],
    "twice": lambda rng, f: [bytes(f) * rng.randint(2, 5)],
    "after another": lambda rng, f: [
        bytes(replace(f, transaction=rng.randrange(65536), body=_flipped(rng, f.body))) + bytes(f)
    ],
    "ahead of the next": lambda rng, f: [
        bytes(f),
        bytes(replace(f, transaction=f.transaction + 1 & 0xFFFF)),
    ],
    "noise": lambda rng, f: [rng.randbytes(rng.randint(1, 600))],
    "noise first": lambda rng, f: [rng.randbytes(rng.randint(1, 20)), bytes(f)],
    "hang up": lambda rng, f: [HANG_UP],
    "hang up half way": lambda rng, f: [bytes(f)[: rng.randrange(len(bytes(f)))], HANG_UP],
    "nothing": lambda rng, f: [],
}

RARE: dict[str, Mutation] = {
    "dribble": lambda rng, f: [
        piece
        for byte in (bytes(f) * 20)[:200]
        for piece in (bytes([byte ^ rng.randrange(2)]), 0.002)
    ],
    "flood": lambda rng, f: [rng.randbytes(65536)] * 64,
    "flood of replies": lambda rng, f: [bytes(replace(f, body=_flipped(rng, f.body))) * 500] * 20,
}
"""What takes long to send."""


def mutated(rng: Random, frame: Frame) -> tuple[str, Script]:
    """Return a mutation's name and what it makes of a frame."""
    mutations = RARE if rng.random() < 0.001 else MUTATIONS
    name = rng.choice(list(mutations))
    return name, mutations[name](rng, frame)
