"""A block: neighbouring registers that one exchange reads or writes."""

from typing import Literal

from pydantic import Field

from pipelines.settings.base import Settings
from pipelines.settings.rig.register import DIMENSION, STRUCT_CODES, Register

# "MODBUS application protocol specification" V1.1b3: FC03 and FC23 read 125, FC23 writes 121 at
# most.
MOST_REGISTERS = {"read": 125, "write": 121, "record": 125}
"""Registers that one exchange carries."""


class ReadSettings(Settings):
    """How a device is read: the function code, and the registers of one request."""

    function: Literal[3, 4] = Field(3, description="3 reads holding, 4 input registers.")
    most_words: int = Field(
        MOST_REGISTERS["read"],
        ge=1,
        le=MOST_REGISTERS["read"],
        description="Most registers that the device answers in one request.",
    )


class ReadBlock(ReadSettings):
    """A block that is read, in several requests where one cannot carry it."""

    across_gaps: bool = Field(True, description="Whether registers between the named are read.")


def registers_of(block: Settings) -> dict[str, Register]:
    """Return the registers that a block has, by quantity."""
    return {name: value for name, value in block if isinstance(value, Register)}


def check_block(block: Settings, name: str) -> None:
    """Refuse units, counters, overlaps and lengths that a block cannot have.

    Raises
    ------
    ValueError
        Naming the first register that is wrong.
    """
    registers = registers_of(block)
    for quantity, register in registers.items():
        if register.unit not in DIMENSION[quantity]:
            allowed = " or ".join(DIMENSION[quantity])
            raise ValueError(f"{name}.{quantity}.unit: found {register.unit!r}, expected {allowed}")
    for quantity in ("sequence", "heartbeat"):
        if quantity in registers:
            check_counter(registers[quantity], f"{name}.{quantity}")
    if "time" in registers and registers["time"].encoding != "binary":
        raise ValueError(
            f"{name}.time.encoding: found {registers['time'].encoding}, expected a binary clock"
        )
    if "time" in registers and registers["time"].scale < 0.0:
        raise ValueError(
            f"{name}.time.scale: found {registers['time'].scale:g}, expected a clock that goes"
            " forward; turn its sign"
        )
    _check_addresses(registers, name)
    if isinstance(block, ReadSettings):
        _check_words(registers, block.most_words, name)
    else:
        _check_length(registers, name)


def _check_words(registers: dict[str, Register], most_words: int, name: str) -> None:
    """Refuse values that do not fit into a request, as halves may be of two samples."""
    for quantity, register in registers.items():
        if register.registers > most_words:
            raise ValueError(
                f"{name}.most_words: found {most_words}, but {quantity} takes"
                f" {register.registers} registers, which one request must bring"
            )


def _check_addresses(registers: dict[str, Register], name: str) -> None:
    """Refuse registers that overlap."""
    taken: dict[int, str] = {}
    for quantity, register in registers.items():
        for address in register.addresses:
            if address in taken:
                raise ValueError(
                    f"{name}.{quantity}: register {address} is part of {taken[address]} too"
                )
            taken[address] = quantity


def _check_length(registers: dict[str, Register], name: str) -> None:
    """Refuse too many registers for one exchange."""
    taken = [address for register in registers.values() for address in register.addresses]
    # Registers in between count too.
    length = max(taken) - min(taken) + 1
    if length > MOST_REGISTERS[name]:
        raise ValueError(
            f"{name}: spans {length} registers ({min(taken)} to {max(taken)}), expected at most"
            f" {MOST_REGISTERS[name]}, the most that one Modbus exchange carries"
        )


def check_counter(register: Register, name: str) -> None:
    """Refuse a counter whose raw value is not the count, as its wraparound is then unknown.

    Raises
    ------
    ValueError
        It has a scale, an offset, a sign or decimal digits; names its place in the file.
    """
    encoded = register.encoding_keys
    is_plain = register.is_unsigned and not encoded
    if not is_plain or (register.scale, register.offset) != (1.0, 0.0):
        *others, last = (kind for kind, code in STRUCT_CODES.items() if code.isupper())
        raise ValueError(
            f"{name}: found {register.type} with scale {register.scale:g} and offset"
            f" {register.offset:g}, expected {', '.join(others)} or {last} without scale or offset"
            f"{f'; remove {encoded[0]}' if encoded else ''}"
        )
