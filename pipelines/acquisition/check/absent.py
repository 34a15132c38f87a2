"""Why a device does not answer: another unit id, or frames of another kind."""

import asyncio
from collections.abc import Iterator, Sequence
from contextlib import suppress

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ModbusPDU

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.probe import Probe
from pipelines.acquisition.machine.read_only import ReadOnlyPart
from pipelines.acquisition.modbus.device import Device, greeting, read_request
from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.modbus.unexpected import answering_unit
from pipelines.errors import DeviceError, Refused
from pipelines.settings.rig.line import RtuOverTcpLine, TcpLine
from pipelines.settings.rig.safety import SafetySettings

ABSENT = (ExcCodes.GATEWAY_PATH_UNAVIABLE, ExcCodes.GATEWAY_NO_RESPONSE)
"""Exceptions by which a gateway reports that a device is not there."""
TRIAL_S = 0.3
"""Longest wait for an answer under another unit id, or in other frames."""


async def explain_absence(probe: Probe, probes: Sequence[Probe]) -> Finding | None:
    """Return how a silent device can be reached, with the key to change; None if unknown.

    Parameters
    ----------
    probes : sequence of Probe
        All devices of the rig; their units are not tried.
    """
    line, unit = probe.part.device.line, probe.part.settings.unit
    if line.traffic.came and not line.has_answered:  # the bytes say it
        return None
    if not line.has_answered:
        transport = await _other_frames(probe, line)
        if transport:
            return Finding(
                "rig",
                f'{line.label}: answers in other frames; set transport = "{transport}" of its'
                " [line]",
            )
    else:
        if not line.client.connected:
            await line.connect()
        if await _is(probe, unit):  # it is there: one answer, or the connection, was lost
            return None
    other = await _other_unit(probe, probes)
    if other is None:
        return await _explain_only_unit(probe, probes)
    probe.answers_as = other
    return probe.finding(f"does not answer as unit {unit}, but unit {other} does; correct unit")


def explain_other_unit(probe: Probe, probes: Sequence[Probe]) -> Finding | None:
    """Return a finding if the answer came in the name of another device's unit; else None."""
    traffic = probe.part.device.line.traffic
    other, asked = answering_unit(traffic.asked, traffic.came), probe.part.settings.unit
    if other is None:
        return None
    owner = _units_of_others(probe, probes).get(other)
    if owner is None:
        probe.answers_as = other
        return None  # the error says it
    return probe.finding(
        f"asked as unit {asked}, an answer came from unit {other}, which is {owner}'s; let the"
        f" gateway pass on all units{_or_share(probe, other)}"
    )


async def _explain_only_unit(probe: Probe, probes: Sequence[Probe]) -> Finding | None:
    """Return a finding if one unit alone answers, and is another device's; else None."""
    owners = _units_of_others(probe, probes)
    answering = [unit for unit in owners if await _answers(probe, unit)]
    if len(answering) != 1:  # a gateway that passes on several passes on all
        return None
    (unit,) = answering
    return probe.finding(
        f"does not answer as unit {probe.part.settings.unit}, only unit {unit} does, which is"
        f" {owners[unit]}'s; check its cable, its power and the gateway's units"
        f"{_or_share(probe, unit)}"
    )


def _units_of_others(probe: Probe, probes: Sequence[Probe]) -> dict[int, str]:
    """Return the units of the devices at the same place, as far as known, and their names."""
    place, unit = probe.part.device.line.place, probe.part.settings.unit
    return {
        other.part.settings.unit if other.answers_as is None else other.answers_as: other.name
        for other in probes
        if other.part.device.line.place == place and other.part.settings.unit != unit
    }


def _or_share(probe: Probe, unit: int) -> str:
    """Return how two joints of one controller are described, where a rig file may do that."""
    if not isinstance(probe.part, ReadOnlyPart):
        return ""
    return f". If one controller serves both, set unit = {unit} and a map of its own"


async def explain_identity(probe: Probe, probes: Sequence[Probe]) -> Finding | None:
    """Return where the identity of a device is, if not where the rig file says; None if unknown."""
    identity, function = probe.part.map.identity, probe.part.reader.function
    for by, direction in ((1, "low"), (-1, "high")):
        moved = [entry.model_copy(update={"address": entry.address + by}) for entry in identity]
        if min(entry.address for entry in moved) < 0:
            continue
        with suppress(DeviceError):
            await probe.part.device.check_identity(moved, function)
            return probe.finding(
                f"{probe.map_path}.identity is one address too {direction}; correct it, and look"
                " at the other addresses of this map, too"
            )
    unit = await _other_unit(probe, probes)
    if unit is None:
        return None
    return probe.finding(
        f"unit {probe.part.settings.unit} is another device, but unit {unit} has this identity;"
        " correct unit"
    )


async def _other_frames(probe: Probe, line: Line) -> str | None:
    """Return the transport of the frames that are answered on a connection of its own."""
    settings = line.settings
    other: TcpLine | RtuOverTcpLine
    if isinstance(settings, TcpLine):
        other = RtuOverTcpLine(transport="rtu_over_tcp", host=settings.host, port=settings.port)
    elif isinstance(settings, RtuOverTcpLine):
        other = TcpLine(host=settings.host, port=settings.port)
    else:
        return None
    # A server may take one client only.
    line.close()
    trial = Line(other, TRIAL_S)
    trial.traffic.trace = line.traffic.trace
    device = Device(probe.name, probe.part.settings.unit, trial, SafetySettings(connect_s=TRIAL_S))
    try:
        await trial.connect()
        await device.read_anything(probe.part.map.identity, probe.part.map.read)
    except Refused:
        pass  # an exception is a frame, too
    except DeviceError:
        return None
    finally:
        trial.close()
    return other.transport


async def _other_unit(probe: Probe, probes: Sequence[Probe]) -> int | None:
    """Return a unit that answers in place of a device, with its identity if the file names one."""
    # Longest search; a gateway that reports missing units is faster than a silent bus.
    search_s = 2.0
    line = probe.part.device.line
    if not line.client.connected:
        try:
            await line.connect()
        except DeviceError:
            return None
    taken = _units_of_others(probe, probes)
    loop = asyncio.get_running_loop()
    until = loop.time() + search_s
    for unit in _likely_units(probe.part.settings.unit, line.has_transaction_ids):
        if loop.time() > until:
            return None
        if unit not in taken and await _is(probe, unit):
            return unit
    return None


def _likely_units(unit: int, on_tcp: bool) -> Iterator[int]:
    """Yield units, the likeliest first; each once."""
    first, last = (0, 255) if on_tcp else (1, 247)
    likely = [1, 255, 0, unit - 1, unit + 1, 2, 247, *range(3, last + 1)]
    yield from dict.fromkeys(one for one in likely if first <= one <= last and one != unit)


async def _is(probe: Probe, unit: int) -> bool:
    """Return whether a unit answers, with the device's identity if the rig file names one."""
    reply, identity = await _greeted(probe, unit), probe.part.map.identity
    words = list(getattr(reply, "registers", []))
    return bool(reply and not reply.isError()) and (not identity or words == [identity[0].value])


async def _answers(probe: Probe, unit: int) -> bool:
    """Return whether a unit answers at all; a gateway answers for a unit that is not there."""
    reply = await _greeted(probe, unit)
    return reply is not None and getattr(reply, "exception_code", None) not in ABSENT


async def _greeted(probe: Probe, unit: int) -> ModbusPDU | None:
    """Return a unit's reply to the device's greeting; None for no reply."""
    line = probe.part.device.line
    address, function = greeting(probe.part.map.identity, probe.part.map.read)
    request = read_request(line.client, function)
    try:
        return await line.ask(unit, TRIAL_S, request, address=address, count=1)
    except (ModbusException, OSError, DeviceError):
        return None
