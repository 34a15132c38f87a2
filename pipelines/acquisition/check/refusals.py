"""Why a device refuses a block: the function, a register that does not exist, or too many words."""

from collections.abc import Sequence

from pymodbus.constants import ExcCodes
from pymodbus.pdu.register_message import ReadWriteMultipleRegistersRequest

from pipelines.acquisition.check.probe import Probe
from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.modbus.device import FOR_NOW
from pipelines.errors import DeviceError, Refused
from pipelines.modbus.functions import READ_HOLDING, READ_INPUT, READ_WRITE
from pipelines.settings.rig import Register

Named = tuple[str, Register]


async def explain_refusal(probe: Probe, refusal: Refused) -> str | None:
    """Return in words why a device refuses its block, with the key to change; None if unknown.

    It is found by reading parts of the block.
    """
    where, reader = f"{probe.map_path}.read", probe.part.reader
    if refusal.code == ExcCodes.ILLEGAL_FUNCTION:
        other = READ_INPUT if reader.function == READ_HOLDING else READ_HOLDING
        first = min(reader.block.registers.values(), key=lambda one: one.address)
        if await _answers(probe, first.addresses, other):
            return (
                f"does not know function {reader.function}, but answers {other}; set"
                f" {where}.function = {other}"
            )
        return None
    named = sorted(reader.block.registers.items(), key=lambda one: one[1].address)
    for request in reader.requests:
        inside = [one for one in named if one[1].address in request]
        if not await _answers(probe, request):
            return await _explain_part(probe, inside, where)
    return None


async def lacks_exchange(probe: Probe) -> str | None:
    """Return in words that a drive does not know FC23, though its map needs it; None if it does.

    The request writes no register: a drive that knows the function refuses the number, or takes it.
    """
    drive = probe.part
    if not isinstance(drive, Drive) or drive.map.write.function != READ_WRITE:
        return None
    request = _NoWrites(
        read_address=drive.read_block.address,
        read_count=1,
        write_address=drive.write_block.address,
    )
    try:
        await drive.device.send(request)
    except Refused as error:
        if error.code == ExcCodes.ILLEGAL_FUNCTION:
            return f"does not know function 23; set {probe.map_path}.write.function = 16"
    except DeviceError:  # it ignores a request for nothing, which shows nothing
        pass
    return None


class _NoWrites(ReadWriteMultipleRegistersRequest):
    """An FC23 request that writes no register."""

    def encode(self) -> bytes:
        """Return its content; pymodbus's own method refuses to write nothing."""
        numbers = (self.read_address, self.read_count, self.write_address, 0)
        return b"".join(number.to_bytes(2, "big") for number in numbers) + b"\0"


async def _answers(probe: Probe, addresses: range, function: int | None = None) -> bool:
    """Return whether a device answers to a request for registers."""
    try:
        await probe.part.device.read(
            addresses.start, len(addresses), function=function or probe.part.reader.function
        )
    except Refused as error:
        if error.code in FOR_NOW:  # shows nothing about the registers
            raise
        return False
    return True


def _span(named: Sequence[Named]) -> range:
    return range(named[0][1].address, named[-1][1].addresses.stop)


async def _explain_part(probe: Probe, named: Sequence[Named], where: str) -> str | None:
    """Explain a refused request for registers, ascending by address."""
    # The most leading values that are answered, by halves.
    answered, refused = 0, len(named)
    while refused - answered > 1:
        middle = (answered + refused) // 2
        if await _answers(probe, _span(named[:middle])):
            answered = middle
        else:
            refused = middle
    name, register = named[answered]
    if not await _answers(probe, register.addresses):
        return await _missing_register(probe, name, register, where)
    if not answered:
        return None
    before = named[answered - 1][1]
    is_gap = register.address > before.addresses.stop
    if is_gap and not await _answers(probe, range(before.address, register.addresses.stop)):
        return (
            f"has no registers between {before.addresses.stop - 1} and {register.address}; set"
            f" {where}.across_gaps = false"
        )
    most = len(_span(named[:answered]))
    return (
        f"answers {most} registers a request, but not {len(_span(named[: answered + 1]))}; set"
        f" {where}.most_words = {most}{_and_write(probe)}"
    )


async def _missing_register(probe: Probe, name: str, register: Register, where: str) -> str:
    missing = [
        address
        for address in register.addresses
        if not await _answers(probe, range(address, address + 1))
    ]
    which = f"register {missing[0]}" if missing else f"value at register {register.address}"
    return (
        f"has no {which}, which {where}.{name} needs; correct its address, or leave it out if"
        " it is optional"
    )


def _and_write(probe: Probe) -> str:
    """Return what else a drive needs that cannot bring its block in one exchange."""
    drive = probe.part
    if isinstance(drive, Drive) and drive.map.write.function == READ_WRITE:
        return f" and {probe.map_path}.write.function = 16"
    return ""
