"""What a device sent in place of an answer, in words: from the bytes alone.

A time-out says that no answer came, but not that nothing came. Most mistakes in a rig file, and
most faults of a gateway, show in the bytes.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from pymodbus.framer import FramerRTU

MBAP = 7
"""Bytes before the function in a Modbus TCP frame: transaction, protocol, length and unit."""


@dataclass(frozen=True)
class Asked:
    """A request, as it was sent."""

    frame: bytes
    unit: int
    transaction: int
    """0 where frames carry none."""
    function: int
    in_rtu: bool
    """Whether it was sent in an RTU frame."""


def described(asked: Asked, came: bytes) -> str | None:
    """Return in words what came in place of an answer, with a remedy; None for nothing.

    Parameters
    ----------
    asked : Asked
        The request.
    came : bytes
        All bytes since then; none of them was taken for its answer.
    """
    if not came:
        return None
    echo = came.startswith(asked.frame)
    rest = came[len(asked.frame) :] if echo else came
    if not rest:
        return (
            f"sent back the request itself ({as_hex(came)}): the adapter echoes, and no device"
            " answers behind it; check the cable behind it, and unit"
        )
    return _as_frames(asked, rest) or _as_text(rest) or _as_bytes(asked, rest)


def answering_unit(asked: Asked, came: bytes) -> int | None:
    """Return the unit in the frame that came in place of an answer; None if there is none."""
    if asked.in_rtu:
        units = [*_rtu_units(came.removeprefix(asked.frame))]
    else:
        in_tcp = _tcp_frame(came)
        units = [in_tcp[1]] if in_tcp else []
    return next((unit for unit in units if unit != asked.unit), None)


def as_hex(data: bytes, most: int = 16) -> str:
    """Return the first bytes in hexadecimal."""
    shown = data[:most].hex(" ")
    return f"{shown} ..." if len(data) > most else shown


def _as_frames(asked: Asked, came: bytes) -> str | None:
    """Describe bytes that are a whole Modbus frame of either kind."""
    in_tcp = _tcp_frame(came)
    if in_tcp is not None:
        transaction, unit = in_tcp
        if asked.in_rtu:
            return (
                f"answered in a Modbus TCP frame ({as_hex(came)}), expected RTU; set"
                ' transport = "tcp"'
            )
        if unit != asked.unit:
            return _under_other_unit(asked, unit, came)
        return _of_other_transaction(asked, transaction, came)
    for unit in _rtu_units(came):
        if not asked.in_rtu:
            return (
                f"answered in an RTU frame ({as_hex(came)}), expected Modbus TCP; set"
                ' transport = "rtu_over_tcp"'
            )
        if unit != asked.unit:
            return _under_other_unit(asked, unit, came)
    return None


def _under_other_unit(asked: Asked, unit: int, came: bytes) -> str:
    return (
        f"answered under unit {unit}, asked unit {asked.unit} ({as_hex(came)}); correct unit in"
        " the rig file, or in the device"
    )


def _of_other_transaction(asked: Asked, transaction: int, came: bytes) -> str | None:
    if transaction == asked.transaction:
        return None
    sent = asked.transaction.to_bytes(2, "big")
    swapped = transaction.to_bytes(2, "little") == sent
    why = "its two bytes are swapped" if swapped else "a late answer, or another program's"
    remedy = "update the gateway" if swapped else "raise safety.reply_s, or end that program"
    return (
        f"answered with transaction 0x{transaction:04X} for 0x{asked.transaction:04X}: {why}"
        f" ({as_hex(came)}); {remedy}"
    )


def _as_text(came: bytes) -> str | None:
    """Describe bytes that a person could read."""
    if not all(byte in b"\r\n\t" or 32 <= byte < 127 for byte in came) or len(came) < 4:
        return None
    text = came.decode("ascii").strip()[:40]
    if text.startswith(":") and all(letter in "0123456789ABCDEF" for letter in text[1:]):
        return f"answered in Modbus ASCII ({text!r}), expected RTU or TCP; set the device to RTU"
    return f"answered with text ({text!r}), expected Modbus; correct host and port"


def _as_bytes(asked: Asked, came: bytes) -> str:
    if _is_begun(asked, came):
        return (
            f"sent only the first {len(came)} bytes of an answer ({as_hex(came)}); check the"
            " line, or raise the time-out"
        )
    remedy = "check baud rate, parity and stop bits"
    if not asked.in_rtu:
        remedy += " behind the gateway, and transport"
    return f"sent {len(came)} bytes that are no frame ({as_hex(came)}); {remedy}"


def _is_begun(asked: Asked, came: bytes) -> bool:
    """Return whether bytes are the beginning of an answer."""
    head = bytes([asked.unit, asked.function])
    if not asked.in_rtu:
        # Transaction and protocol; the length is the device's own.
        head = asked.transaction.to_bytes(2, "big") + b"\0\0"
    return came[: len(head)] == head[: len(came)]


def _tcp_frame(came: bytes) -> tuple[int, int] | None:
    """Return transaction and unit of the Modbus TCP frame at the beginning of bytes, if any."""
    if len(came) <= MBAP + 1 or came[2:4] != b"\0\0":
        return None
    end = MBAP - 1 + int.from_bytes(came[4:6], "big")
    return (int.from_bytes(came[:2], "big"), came[6]) if MBAP + 1 < end <= len(came) else None


def _rtu_units(came: bytes) -> Iterator[int]:
    """Yield the units of the RTU frames in bytes, by their checksums."""
    # The shortest is an exception: unit, function, code and checksum. Noise may come before it.
    shortest = 5
    begin = 0
    while begin + shortest <= len(came):
        for end in range(len(came), begin + shortest - 1, -1):
            body, check = came[begin : end - 2], int.from_bytes(came[end - 2 : end], "big")
            if FramerRTU.check_CRC(body, check):
                yield body[0]
                begin = end - 1
                break
        begin += 1
