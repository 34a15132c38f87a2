"""A block: neighbouring registers that one exchange reads or writes."""

from pipelines.settings.base import Settings
from pipelines.settings.rig.register import DIMENSION, Register

# "MODBUS application protocol specification" V1.1b3: FC03 and FC23 read 125, FC23 writes 121 at
# most.
MOST_REGISTERS = {"read": 125, "write": 121, "record": 125}
"""Registers that one exchange carries."""


def registers_of(block: Settings) -> dict[str, Register]:
    """Return the registers that a block has, by quantity."""
    return {name: register for name, register in block if register is not None}


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
    if "time" in registers and registers["time"].scale < 0.0:
        raise ValueError(
            f"{name}.time.scale: found {registers['time'].scale:g}, expected a clock that goes"
            " forward; turn its sign"
        )
    _check_addresses(registers, name)


def _check_addresses(registers: dict[str, Register], name: str) -> None:
    """Refuse registers that overlap, or too many for one exchange."""
    taken: dict[int, str] = {}
    for quantity, register in registers.items():
        for address in register.addresses:
            if address in taken:
                raise ValueError(
                    f"{name}.{quantity}: register {address} is part of {taken[address]} too"
                )
            taken[address] = quantity
    # Registers in between are read too, whatever they are.
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
        It has a scale, an offset or a sign; names its place in the file.
    """
    if not register.type.startswith("u") or (register.scale, register.offset) != (1.0, 0.0):
        raise ValueError(
            f"{name}: found {register.type} with scale {register.scale:g} and offset"
            f" {register.offset:g}, expected uint16, uint32 or uint64 without scale or offset"
        )
