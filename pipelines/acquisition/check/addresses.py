"""Whether a block is right at other addresses: one too low, one too high, or with a manual's 4."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass

from pydantic import ValidationError

from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.modbus.blocks import BlockReader
from pipelines.errors import DeviceError
from pipelines.settings.rig.block import ReadBlock, registers_of


@dataclass(frozen=True)
class MovedBlock:
    """A block with some of its registers at other addresses."""

    by: int
    names: tuple[str, ...]
    """Quantities that are moved."""
    reader: BlockReader


def moved_blocks(probe: Probe, misread: Collection[str]) -> Iterator[MovedBlock]:
    """Yield a device's block with other addresses, the likeliest first.

    Parameters
    ----------
    misread : collection of str
        Quantities that cannot be right; they may be moved without the others.
    """
    settings = probe.part.map.read
    everything = tuple(registers_of(settings))
    for by in _distances(probe):
        yield from _moved(probe, settings, by, everything)
    some = tuple(name for name in everything if name in misread)
    if some and some != everything:
        for by in (1, -1):
            yield from _moved(probe, settings, by, some)


def in_words(probe: Probe, moved: MovedBlock) -> str:
    """Return which addresses of the rig file are wrong, and how to correct them."""
    where = f"{probe.map_path}.read"
    everything = len(moved.names) == len(probe.block.names)
    what = f"all of {where} is" if everything else f"{', '.join(moved.names)} of {where} are"
    is_written = isinstance(probe.part, Drive)
    also = f"; {probe.map_path}.write may be, too" if is_written and everything else ""
    if abs(moved.by) == 1:
        direction, remedy = ("low", "add 1 to") if moved.by > 0 else ("high", "subtract 1 from")
        return (
            f"{what} one address too {direction}: {remedy} each (manuals count from 1, the rig"
            f" file from 0){also}"
        )
    return (
        f"{what} {-moved.by} too high: subtract it from each address, which the manual writes with"
        f" the kind of register in front{also}"
    )


async def read_moved(moved: MovedBlock, seconds: float) -> Series | None:
    """Read a moved block for a while; None where the device refuses it."""
    try:
        return await Series.read(moved.reader, seconds)
    except DeviceError:
        return None


def _distances(probe: Probe) -> list[int]:
    """Return by how far a whole block may have been misplaced, the likeliest first."""
    # A manual's 40001 is the first holding register, 30001 the first input register.
    kind = {3: 40000, 4: 30000}[probe.part.reader.function]
    if probe.block.address < kind:
        return [1, -1]
    return [-kind - 1, -kind, 1, -1]


def _moved(
    probe: Probe, settings: ReadBlock, by: int, names: tuple[str, ...]
) -> Iterator[MovedBlock]:
    changed: dict[str, dict] = {
        name: register.model_dump()
        for name, register in registers_of(settings).items()
        if name in names
    }
    for register in changed.values():
        for place in filter(None, (register, register["direction"])):
            place["address"] += by
    try:
        # Validated again: an address may now be impossible.
        read = type(settings).model_validate(settings.model_dump(exclude_none=True) | changed)
    except ValidationError:
        return
    taken = [address for one in registers_of(read).values() for address in one.addresses]
    if len(set(taken)) == len(taken):
        yield MovedBlock(by, names, BlockReader(probe.part.device, read))
