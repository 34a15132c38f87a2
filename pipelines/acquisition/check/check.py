"""The whole check of a rig file, from the connections to the findings."""

import asyncio
import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Literal

from pipelines.acquisition.check.by_drives import move_by_drives, refuse_far_from_zero
from pipelines.acquisition.check.by_hand import Operator, by_hand
from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.survey import RigReport, probes_of, survey, survey_read_only
from pipelines.acquisition.machine.embedded_rig import embedded
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.machine.read_only import ReadOnlyMachine
from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.exclusive_access import exclusive_access
from pipelines.acquisition.preconditions.feasible_rate import rate_checks
from pipelines.acquisition.preconditions.human_interlock import refuse_rare_readings
from pipelines.acquisition.preconditions.set_point_scale import set_point_contradictions
from pipelines.errors import DeviceError, InputError, SettingsError
from pipelines.process.priority import urgent
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import RigSettings, load_rig
from pipelines.settings.rig.recording_only import (
    RecordingRig,
    is_recording_only,
    load_recording_rig,
)

TraceLine = Callable[[str], None]


def check_rig(
    path: Path,
    rate_hz: float | None = None,
    run: Literal["exo_alone", "with_human"] = "exo_alone",
    operator: Operator | None = None,
    *,
    move: bool = False,
    trace: TraceLine | None = None,
) -> RigReport:
    """Check every device of a rig against its file; move nothing unless ``move`` is set.

    Parameters
    ----------
    path : Path
        The rig file. An embedded rig is started first.
    rate_hz : float, optional
        Samples a second of the experiment; by default a virtual rig's own, or the measured ones of
        a real rig.
    run : str
        Whether a person is in the machine: sensors' zeros are only checked in an empty one.
    operator : Operator, optional
        Asks a person to move the joints and press the cuffs, if all devices answer.
    move : bool
        Whether the drives move the joints a little, if there is no finding.
    trace : callable, optional
        Takes a line of text for all bytes that are sent or come.

    Raises
    ------
    SettingsError
        ``move`` is set without a rate, and the drives record by themselves.
    DeviceError
        Another process holds one of the lines; nothing is connected then.
    """
    if run == "with_human":
        refuse_to_move_a_person(by_hand=operator is not None, move=move)
    if is_recording_only(path):
        if operator or move:
            raise SettingsError(f"{path}: is recording_only; leave out --by-hand and --move")
        return _check_read_only(load_recording_rig(path), rate_hz, trace)
    rig = load_rig(path)
    if rate_hz is None and rig.plant:
        rate_hz = rig.plant.sample_rate_hz
    if move and rate_hz is None and rig.sampling == "recorder":
        raise SettingsError(
            "--rate-hz: missing; give the rate of set-points, as drives that record do not show it"
        )
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # what it would print, our errors say
    settings = RunSettings(name="check", run=run, purpose="train")
    place = embedded(rig, path, settings, rate_hz) if rig.embedded and rate_hz else nullcontext(rig)
    with place as present, nullcontext() if rig.clock == "lockstep" else urgent():
        # Reading alone would already slow down another run, whose motion would give wrong findings.
        # The movement holds the lines itself.
        with exclusive_access(present):
            report, start = asyncio.run(
                _check(present, rate_hz, run == "exo_alone", operator, trace)
            )
        if move and not report.findings:
            try:
                if not report.by_hand:
                    refuse_far_from_zero(start)
                report.moved, report.findings = move_by_drives(
                    present, start, rate_hz or _measured_rate(report), run
                )
            except InputError as error:  # the report so far must not be lost
                report.findings.append(Finding("rig", str(error)))
        return report


def _check_read_only(
    rig: RecordingRig, rate_hz: float | None, trace: TraceLine | None
) -> RigReport:
    """Check a machine that exoid only reads."""
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # what it would print, our errors say

    async def check() -> RigReport:
        machine = ReadOnlyMachine(rig)
        _trace([part.device for part in machine.parts], trace)
        try:
            return await survey_read_only(machine, rig, rate_hz)
        finally:
            machine.close()

    with exclusive_access(rig):
        return asyncio.run(check())


def _trace(devices: Sequence[Device], trace: TraceLine | None) -> None:
    """Let all bytes of the devices' lines be shown."""
    if trace is None:
        return
    began = time.perf_counter()
    for device in devices:
        place = device.line.place

        def show(sent: bool, data: bytes, place: str = place) -> None:
            arrow = ">" if sent else "<"
            trace(f"{time.perf_counter() - began:9.4f} s {place} {arrow} {data.hex(' ')}")

        device.line.traffic.trace = show


def refuse_to_move_a_person(*, by_hand: bool, move: bool) -> None:
    """Refuse to move or disable a leg of unverified signs while a person is in it."""
    for option, given in (("--by-hand", by_hand), ("--move", move)):
        if given:
            raise InputError(
                f"{option} needs an empty machine, but --run with_human means a person; drop one"
            )


def rate_findings(rig: RigSettings, rate_hz: float | None) -> Iterator[Finding]:
    """Yield why every run at a rate is refused with this rig file."""
    if rate_hz is None or rig.clock == "lockstep":
        return
    for refuse in (*rate_checks(with_sensors=True), refuse_rare_readings):
        try:
            refuse(rig, rate_hz)
        except SettingsError as error:
            yield Finding("rig", str(error))


def _measured_rate(report: RigReport) -> float:
    """Return the measured rate of the first drive's samples, Hz."""
    clock = report.devices[0].clock
    assert clock and clock.counter_hz  # else there are findings
    return clock.counter_hz


async def _check(
    rig: RigSettings,
    rate_hz: float | None,
    is_empty: bool,
    operator: Operator | None,
    trace: TraceLine | None = None,
) -> tuple[RigReport, list[float]]:
    """Return the report, and the leg's angles (J,) rad at its end if there is no finding."""
    machine = Machine(rig, with_sensors=True)
    _trace([probe.part.device for probe in probes_of(machine)], trace)
    try:
        report = await survey(machine, rate_hz, is_empty=is_empty)
        report.findings += rate_findings(rig, rate_hz)
        report.findings += [Finding("rig", why) for why in set_point_contradictions(rig)]
        if operator and all(device.latency for device in report.devices):
            report.by_hand = True
            try:
                await machine.refuse_driven()
                report.findings += await by_hand(probes_of(machine), rig, rate_hz, operator)
            except DeviceError as error:
                report.findings.append(Finding("rig", str(error)))
        return report, (
            [] if report.findings else [(await drive.look()).angle for drive in machine.drives]
        )
    finally:
        machine.close()
