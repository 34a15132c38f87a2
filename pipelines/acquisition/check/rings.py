"""Whether a drive's own record brings every sample, and tells of it what the block of registers does."""

import asyncio
import time
from collections.abc import Sequence

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.plausible import STEP_RAD
from pipelines.acquisition.check.probe import Probe
from pipelines.acquisition.drive import Drive, Reading
from pipelines.acquisition.frozen import Told
from pipelines.acquisition.machine import Machine
from pipelines.acquisition.stream import Stream
from pipelines.errors import DeviceError, ExoidError

DRAINS = 40
"""How often each record is drained, once a cycle."""


async def check_rings(machine: Machine, probes: Sequence[Probe], rate_hz: float | None) -> list[Finding]:
    """Drain every drive's record for a while, and judge it as a run does; in lockstep the drives go on by cycles.

    Parameters
    ----------
    machine : Machine
        Connected.
    probes : sequence of Probe
        Of the devices that answer.
    rate_hz : float, optional
        Set-points a second that are wanted.
    """
    findings = []
    cycle_hz = rate_hz or machine.rig.record_rate_hz
    assert cycle_hz  # a rig file that asks for recorders has one
    for j, drive in enumerate(machine.drives):
        try:
            why = await _judged(machine, j, drive, [probe for probe in probes if probe.is_drive], cycle_hz)
        except ExoidError as error:
            why = str(error).removeprefix(f"{drive.device.label}: ")
        if why:
            findings.append(Finding(f"drive {drive.settings.joint}", why))
    return findings


async def _judged(machine: Machine, j: int, drive: Drive, drives: Sequence[Probe], cycle_hz: float) -> str | None:
    """Return what is wrong with one drive's record."""
    told, told_by_block, records = Told(), dict[int, Reading](), list[Reading]()
    stream = Stream(machine.rig, j, cycle_hz, told)
    await drive.empty_record()
    for _ in range(DRAINS):
        await asyncio.gather(*(probe.step() for probe in drives))
        reading = await drive.look()
        told_by_block[reading.sequence] = reading
        try:
            found = await drive.drain(reading.sequence)
        except DeviceError as error:
            return f"its record cannot be drained ({error}); compare {_where(drive)} with the device's manual"
        for record in found:
            told.tell(record.sequence, record.reference)  # nobody sends any
            records += [record] if stream.take(record, time.monotonic()) else []
        await asyncio.sleep(0.0 if drive.in_lockstep else 1.0 / cycle_hz)
    for probe in drives:
        probe.taken()
    if not records:
        return f"its record brought no sample in {DRAINS} cycles; compare {_where(drive)} with the device's manual"
    for record in records:
        block = told_by_block.get(record.sequence)
        if block and abs(record.angle - block.angle) > STEP_RAD:
            return (
                f"its record tells angle {record.angle:.4g} rad of a sample of which read tells {block.angle:.4g} rad; "
                f"compare {_where(drive)}.record with the device's manual"
            )
    return None


def _where(drive: Drive) -> str:
    return f"map.drive.{drive.settings.map}.ring"
