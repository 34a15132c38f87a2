"""Whether a drive's own record has every sample, in agreement with its registers."""

import asyncio
import time
from collections.abc import Sequence

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.probe import Probe
from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.machine.drive_protocol import empty_recorder
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.safety.record_agreement import RecordAgreement
from pipelines.acquisition.safety.sample_stream import SampleStream
from pipelines.acquisition.safety.set_point_history import SetPointHistory
from pipelines.errors import DeviceError, ExoidError


async def check_rings(
    machine: Machine, probes: Sequence[Probe], rate_hz: float | None
) -> list[Finding]:
    """Drain every drive's record for a while, and check it as in a run.

    Parameters
    ----------
    machine : Machine
        Connected.
    probes : sequence of Probe
        Those of the devices that answer.
    rate_hz : float, optional
        Set-points a second of the experiment.
    """
    findings = []
    cycle_hz = rate_hz or machine.rig.record_rate_hz
    assert cycle_hz  # the rig file is checked: recorders have a rate
    drive_probes = [probe for probe in probes if probe.is_drive]
    for j, drive in enumerate(machine.drives):
        try:
            why = await _fault(machine, j, drive, drive_probes, cycle_hz)
        except ExoidError as error:
            why = str(error).removeprefix(f"{drive.device.label}: ")
        if why:
            findings.append(Finding(f"drive {drive.settings.joint}", why))
    return findings


async def _fault(
    machine: Machine, j: int, drive: Drive, drives: Sequence[Probe], cycle_hz: float
) -> str | None:
    """Return the fault of one drive's record; None for a sound one."""
    # Drains of each record, one a cycle.
    drains = 40
    history, begun = SetPointHistory(), False
    stream = SampleStream(machine.rig, j, cycle_hz, history)
    agreement = RecordAgreement(machine.rig, j, cycle_hz * machine.rig.samples_per_cycle(cycle_hz))
    await empty_recorder(drive)
    for _ in range(drains):
        # In lockstep this advances the drives, which would record nothing otherwise.
        await asyncio.gather(*(probe.step() for probe in drives))
        reading = await drive.look()
        agreement.add(reading)
        try:
            records = await drive.drain(reading.sequence)
        except DeviceError as error:
            return f"its record cannot be drained ({error}); correct {_where(drive)}"
        for record in records:
            history.add(record.sequence, record.reference)  # none is sent: the drive's own
            agreement.check(record)
            begun |= stream.check(record, time.monotonic())
        await asyncio.sleep(0.0 if drive.in_lockstep else 1.0 / cycle_hz)
    for probe in drives:
        probe.take()
    if not begun:
        return f"its record brought no sample in {drains} cycles; correct {_where(drive)}"
    return None


def _where(drive: Drive) -> str:
    return f"map.drive.{drive.settings.map}.ring"
