"""The comparison of a rig with its file by reading every device, without moving anything."""

import asyncio
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from pipelines.acquisition.check.absent import (
    ABSENT,
    explain_absence,
    explain_identity,
    explain_other_unit,
)
from pipelines.acquisition.check.addresses import in_words, moved_blocks, read_moved
from pipelines.acquisition.check.by_drives import Answer
from pipelines.acquisition.check.clock import Clock, check_clock, check_latch, measure_clock
from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.latency import Latency
from pipelines.acquisition.check.plausible import check_registers
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.check.rate import Rate, check_rate, cycles
from pipelines.acquisition.check.refusals import explain_refusal, lacks_exchange
from pipelines.acquisition.check.rings import check_rings
from pipelines.acquisition.check.values import check_values
from pipelines.acquisition.check.velocity import check_velocity, shows_velocity
from pipelines.acquisition.check.zeros import check_zeros
from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.machine.force_sensor import Sensor
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.machine.read_only import ReadOnlyMachine, ReadOnlyPart
from pipelines.acquisition.modbus.device import FOR_NOW
from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.modbus.one_client import greet
from pipelines.acquisition.modbus.wraparound import RATE_TOLERANCE
from pipelines.acquisition.pacing import SLOW
from pipelines.errors import DeviceError, Refused, Unanswered
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.recording_only import RecordingRig

Rig = RigSettings | RecordingRig
ALONE_S = 2.0
"""Longest time in which each device is read alone; one of a machine that moves takes all of it."""
TOGETHER_S = 2.0
DRIVES_S = 1.0
"""Durations of cycles with all devices, and with the drives alone."""
MOVED_S = 0.6
"""How long a block is read at other addresses."""


@dataclass
class DeviceReport:
    """The measurements of one device."""

    name: str
    label: str
    connected: bool = False
    identity: list[dict[str, int]] = field(default_factory=list)
    """``address``, ``expected``, ``found``."""
    latency: Latency | None = None
    faults: str = ""
    """How many readings failed, and why the first did."""
    clock: Clock | None = None
    values: dict[str, float] = field(default_factory=dict)
    """Mean of each register, SI units."""
    noise: dict[str, float] = field(default_factory=dict)
    """Standard deviation of each."""


@dataclass
class RigReport:
    """The measurements of a rig, and the findings, by the keys of ``exoid rig check --json``."""

    rate_hz: float | None
    """The rate of the experiment."""
    recording_only: bool = False
    """Whether exoid only reads the machine."""
    by_hand: bool = False
    """Whether a person moved the leg."""
    moved: list[Answer] = field(default_factory=list)
    """Answers of the joints to their set-points."""
    devices: list[DeviceReport] = field(default_factory=list)
    together: Rate | None = None
    drives_alone: Rate | None = None
    findings: list[Finding] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """What lines do that others do not; it is no fault."""


def probes_of(machine: Machine) -> list[Probe]:
    """Return a probe of each device, drives first."""
    parts: list[Drive | Sensor] = [*machine.drives, *machine.sensors]
    return [Probe(part, machine.rig.clock == "lockstep") for part in parts]


async def survey(machine: Machine, rate_hz: float | None, *, is_empty: bool) -> RigReport:
    """Read every device of a rig and check the answers; in real time nothing is written.

    Parameters
    ----------
    machine : Machine
        Not yet connected; it is connected afterwards.
    rate_hz : float, optional
        Samples a second of the experiment.
    is_empty : bool
        Whether no person is in the machine.
    """
    report = RigReport(rate_hz)
    probes = probes_of(machine)
    present = await _read_alone(probes, report, machine.rig)
    # In lockstep the drives advance only together.
    if len(present) == len(report.devices) or machine.rig.clock == "real_time":
        report.findings += await _measure_cycles(list(present), report)
    for probe, (device, still) in present.items():
        report.findings += _check_speed(probe, device, rate_hz)
        findings = _check_device(
            probe, device, still, probe.take(), machine.rig, rate_hz, is_empty=is_empty
        )
        report.findings += await _with_likelier(probe, findings, machine.rig, rate_hz)
    report.notes = _notes(probes)
    report.findings += _check_rates_equal([device for device, _ in present.values()])
    if machine.rig.sampling == "recorder" and not report.findings:
        report.findings += await check_rings(machine, list(present), rate_hz)
    # A line that is lost again and again is one finding.
    report.findings = list(dict.fromkeys(report.findings))
    return report


async def _read_alone(
    probes: Sequence[Probe], report: RigReport, rig: RigSettings
) -> dict[Probe, tuple[DeviceReport, Series]]:
    """Connect the devices and read each alone; return those that answer, with their answers.

    The report gets a part for each device, and the findings about those that do not answer.
    """
    present: dict[Probe, tuple[DeviceReport, Series]] = {}
    lost = await _connect(probes)
    for line, why in lost.items():
        report.findings.append(
            _finding_of(why, [probe for probe in probes if probe.part.device.line is line])
        )
    for probe in probes:
        device = DeviceReport(probe.name, probe.part.device.label)
        report.devices.append(device)
        if probe.part.device.line in lost:
            continue
        try:
            await _measure_device(probe, device, list(present))
        except DeviceError as error:
            finding = await _explain(probe, error, device, probes, rig, report.rate_hz)
            if finding not in report.findings:  # a lost line gives one error for all its devices
                report.findings.append(finding)
        else:
            still = probe.take()
            device.latency = Latency.of(still.answered - still.asked)
            if device.faults:
                report.findings.append(probe.finding(device.faults))
            present[probe] = device, still
    return present


async def survey_read_only(
    machine: ReadOnlyMachine, rig: RecordingRig, rate_hz: float | None
) -> RigReport:
    """Read every device of a machine that exoid only reads, and check the answers."""
    report, answered = RigReport(rate_hz, recording_only=True), list[Probe]()
    probes = [Probe(part, False) for part in machine.parts]
    for probe in probes:
        device = DeviceReport(probe.name, probe.part.device.label)
        report.devices.append(device)
        try:
            await _measure_device(probe, device, answered)
        except DeviceError as error:
            report.findings.append(await _explain(probe, error, device, probes, rig, rate_hz))
            continue
        answered.append(probe)
        findings = _check_read_only(probe, device, rig, rate_hz)
        report.findings += _check_speed(probe, device, rate_hz)
        report.findings += await _with_likelier(probe, findings, rig, rate_hz)
    report.notes = _notes(probes)
    report.notes += [f"{one.name}: {one.faults}" for one in report.devices if one.faults]
    # A line that is lost again and again is one finding.
    report.findings = list(dict.fromkeys(report.findings))
    return report


def _check_read_only(
    probe: Probe, report: DeviceReport, rig: RecordingRig, rate_hz: float | None
) -> list[Finding]:
    """Check the answers of one device that exoid only reads."""
    series = probe.take()
    report.latency = Latency.of(series.answered - series.asked)
    findings = list(check_registers(probe, series, rig))
    findings += check_values(probe, series, rate_hz)
    if "sequence" in series.block.names:
        seconds = float(series.answered[-1] - series.answered[0])
        report.clock = measure_clock(probe, series, seconds)
        findings += check_clock(probe, series, report.clock, seconds, rate_hz)
        findings += check_latch(probe, series)
    if probe.is_drive and not {one.quantity for one in findings} & {"angle", "velocity"}:
        findings += check_velocity(probe, series, rate_hz)
    for name in series.block.names:
        values = series.of(name)
        report.values[name], report.noise[name] = float(np.mean(values)), float(np.std(values))
    return findings


def _notes(probes: Sequence[Probe]) -> list[str]:
    """Return what lines do that others do not."""
    notes = (note for probe in probes for note in probe.part.device.line.peculiarities)
    return list(dict.fromkeys(notes))


async def _connect(probes: Sequence[Probe]) -> dict[Line, DeviceError]:
    """Open all lines at once, since failures take time; return the errors of those that failed."""
    # One to each place: a server that takes one client gets others only once that one answers.
    lines = list(
        {probe.part.device.line.place: probe.part.device.line for probe in probes[::-1]}.values()
    )
    results = await asyncio.gather(*(line.connect() for line in lines), return_exceptions=True)
    lost = {}
    for line, error in zip(lines, results, strict=True):
        if isinstance(error, DeviceError):
            lost[line] = error
        elif error is not None:
            raise error
    return lost


async def _measure_device(probe: Probe, report: DeviceReport, earlier: Sequence[Probe]) -> None:
    """Read a device's identity, then its block many times."""
    reads = 200  # are enough where nothing moves
    least_s = ALONE_S if isinstance(probe.part, ReadOnlyPart) else 0.0
    # A moving leg tolerates a lost answer only; where nothing moves, any fault costs a row.
    bearable = DeviceError if isinstance(probe.part, ReadOnlyPart) else Unanswered
    device, loop = probe.part.device, asyncio.get_running_loop()
    identity, read = probe.part.map.identity, probe.part.map.read

    async def ask() -> None:
        report.connected = True
        await device.read_anything(identity, read)

    await greet(device, [other.part.device for other in earlier], ask)
    for entry in identity:
        (value,) = await device.read(entry.address, 1, function=entry.function or read.function)
        report.identity.append({"address": entry.address, "expected": entry.value, "found": value})
    await device.check_identity(identity, read.function)
    await probe.read()
    began, count, faults = loop.time(), 1, list[DeviceError]()
    while loop.time() < began + (ALONE_S if count < reads else least_s):
        count += 1
        try:
            await probe.read()
        except bearable as error:
            faults.append(error)
    if faults:
        first = str(faults[0]).removeprefix(f"{device.label}: ")
        report.faults = f"{len(faults)} of {count} readings failed; the first {first}"


async def _explain(
    probe: Probe,
    error: DeviceError,
    device: DeviceReport,
    probes: Sequence[Probe],
    rig: Rig,
    rate_hz: float | None,
) -> Finding:
    """Return the likeliest mistake in the rig file that explains an error; else the error."""
    line, finding = probe.part.device.line, None
    try:
        if isinstance(error, Refused) and error.code in FOR_NOW:
            pass
        elif isinstance(error, Refused) and error.code not in ABSENT:
            finding = await _likelier_block(probe, (), rig, rate_hz)
            if not finding:
                why = await explain_refusal(probe, error)
                finding = probe.finding(why) if why else None
        elif isinstance(error, Refused) or not (line.has_answered and line.traffic.came):
            finding = explain_other_unit(probe, probes) or await explain_absence(probe, probes)
        elif isinstance(error, Unanswered):
            finding = explain_other_unit(probe, probes)
        elif any(entry["found"] != entry["expected"] for entry in device.identity):
            finding = await explain_identity(probe, probes)
    except DeviceError:
        pass  # it stops answering meanwhile: the first error counts
    return finding or _finding_of(error, [probe])


async def _measure_cycles(present: Sequence[Probe], report: RigReport) -> list[Finding]:
    """Measure cycles with all devices, and with the drives alone."""
    drives = [probe for probe in present if probe.is_drive]
    if not drives:
        return []
    try:
        report.together = await cycles(present, TOGETHER_S, report.rate_hz)
        report.drives_alone = await cycles(drives, DRIVES_S, report.rate_hz)
    except DeviceError as error:
        return [_finding_of(error, present)]
    if drives[0].in_lockstep or report.rate_hz is None:
        return []
    return list(check_rate(report.together, report.drives_alone, report.rate_hz))


def _finding_of(error: DeviceError, probes: Sequence[Probe]) -> Finding:
    """Return an error as a finding about the device that it names."""
    for probe in probes:
        if str(error).startswith(probe.part.device.label):
            return probe.finding(str(error).removeprefix(f"{probe.part.device.label}: "))
    return Finding("rig", str(error))


def _check_speed(probe: Probe, report: DeviceReport, rate_hz: float | None) -> Iterator[Finding]:
    """Yield a finding if a device answers too slowly for the experiment."""
    assert report.latency
    if probe.in_lockstep or not rate_hz:
        return
    if report.latency.median_ms > 1e3 * SLOW * probe.every / rate_hz:
        yield probe.finding(
            f"takes {report.latency.median_ms:.3g} ms to answer, too long for a sample of"
            f" {rate_hz:g} Hz ({probe.every * 1e3 / rate_hz:.3g} ms); give it a line of its own,"
            " raise its baud rate, or ask less often",
        )


def _check_device(
    probe: Probe,
    report: DeviceReport,
    still: Series,
    together: Series,
    rig: RigSettings,
    rate_hz: float | None,
    *,
    is_empty: bool,
) -> list[Finding]:
    """Check the answers of one device: those of the readings alone, and those of the cycles."""
    findings: list[Finding] = []
    # A rate needs more than one answer.
    series = together if len(together.asked) > 1 else still
    seconds = float(series.answered[-1] - series.answered[0])
    if probe.in_lockstep and rate_hz:
        # In lockstep time is counted in samples: the computer's clock shows only how fast it
        # simulates.
        seconds = (len(series.asked) - 1) * probe.every / rate_hz
    if series is together:
        report.clock = measure_clock(probe, series, seconds)
        counts_hz = _counts_hz(probe, rig, rate_hz)
        findings += check_clock(probe, series, report.clock, seconds, counts_hz)
    if not probe.in_lockstep:
        findings += check_latch(probe, series)
    # A velocity is compared with its angle only if neither is misread; one error is one finding.
    misread = list(check_registers(probe, series, rig))
    findings += misread
    if not probe.is_drive:
        findings += check_zeros(probe, series, rig.safety.cuff_force_n, is_empty=is_empty)
    elif not {finding.quantity for finding in misread} & {"angle", "velocity"}:
        findings += check_velocity(probe, series, rate_hz)
    for name in series.block.names:
        values = series.of(name)[series.fresh]
        report.values[name], report.noise[name] = float(np.mean(values)), float(np.std(values))
    return findings


async def _with_likelier(
    probe: Probe, findings: list[Finding], rig: Rig, rate_hz: float | None
) -> list[Finding]:
    """Return the findings about a device, or the one likelier mistake that explains them all."""
    if probe.in_lockstep:
        return findings
    misread = {finding.quantity for finding in findings} - {""}
    if misread:
        # Smooth values in the other order of words are evidence enough of that alone.
        elsewhere = misread - {finding.quantity for finding in findings if finding.is_explained}
        moved = await _likelier_block(probe, elsewhere, rig, rate_hz)
        findings = [moved] if moved else findings
    lacking = await lacks_exchange(probe)
    return [*findings, probe.finding(lacking)] if lacking else findings


async def _likelier_block(
    probe: Probe, misread: Collection[str], rig: Rig, rate_hz: float | None
) -> Finding | None:
    """Return the finding that a block is at other addresses, if all of it is credible there."""
    for moved in moved_blocks(probe, misread):
        series = await read_moved(moved, MOVED_S)
        if series is not None and _is_credible(probe, series, rig, rate_hz):
            return probe.finding(in_words(probe, moved))
    return None


def _is_credible(probe: Probe, series: Series, rig: Rig, rate_hz: float | None) -> bool:
    """Return whether counter, clock and all other registers have possible values."""
    if "sequence" not in series.block.names:  # nothing else is sure to change
        return (
            shows_velocity(series)
            and not [*check_registers(probe, series, rig)]
            and not [*check_velocity(probe, series, rate_hz)]
        )
    seconds = float(series.answered[-1] - series.answered[0])
    counts_hz = _counts_hz(probe, rig, rate_hz)
    clock = measure_clock(probe, series, seconds)
    return not (
        [*check_clock(probe, series, clock, seconds, counts_hz)]
        or [*check_registers(probe, series, rig)]
    )


def _counts_hz(probe: Probe, rig: Rig, rate_hz: float | None) -> float | None:
    """Return the rate at which a device's counter is expected to count, if it is known."""
    if isinstance(rig, RecordingRig) or rig.sampling == "cyclic":
        return rate_hz
    return rig.record_rate_hz if probe.is_drive else None


def _check_rates_equal(devices: Sequence[DeviceReport]) -> Iterator[Finding]:
    """Yield findings about drives that do not sample at the rate of the first one."""
    drives = [
        (d.name, d.clock.counter_hz) for d in devices if d.name.startswith("drive") and d.clock
    ]
    for name, counter in drives[1:]:
        first = drives[0][1]
        if first and counter and abs(counter / first - 1.0) > RATE_TOLERANCE:
            yield Finding(
                name,
                f"samples {counter:.4g} times a second, {drives[0][0]} {first:.4g}; let all drives"
                " sample at one rate, on one synchronising signal if they have it",
            )
