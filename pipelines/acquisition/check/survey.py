"""The comparison of a rig with its file by reading every device, without moving anything."""

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from pipelines.acquisition.check.by_drives import Answer
from pipelines.acquisition.check.clock import Clock, check_clock, check_latch, measure_clock
from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.latency import Latency
from pipelines.acquisition.check.plausible import check_registers
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.check.rate import Rate, check_rate, cycles
from pipelines.acquisition.check.rings import check_rings
from pipelines.acquisition.check.velocity import check_velocity
from pipelines.acquisition.check.zeros import check_zeros
from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.machine.force_sensor import Sensor
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.modbus.wraparound import RATE_TOLERANCE
from pipelines.acquisition.pacing import SLOW
from pipelines.errors import DeviceError
from pipelines.settings.rig import RigSettings

TOGETHER_S = 2.0
DRIVES_S = 1.0
"""Durations of cycles with all devices, and with the drives alone."""


@dataclass
class DeviceReport:
    """The measurements of one device."""

    name: str
    label: str
    connected: bool = False
    identity: list[dict[str, int]] = field(default_factory=list)
    """``address``, ``expected``, ``found``."""
    latency: Latency | None = None
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
    by_hand: bool = False
    """Whether a person moved the leg."""
    moved: list[Answer] = field(default_factory=list)
    """Answers of the joints to their set-points."""
    devices: list[DeviceReport] = field(default_factory=list)
    together: Rate | None = None
    drives_alone: Rate | None = None
    findings: list[Finding] = field(default_factory=list)


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
    present: dict[Probe, tuple[DeviceReport, Series]] = {}
    probes = probes_of(machine)
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
            await _measure_device(probe, device)
        except DeviceError as error:
            finding = _finding_of(error, [probe])
            if finding not in report.findings:  # a lost line gives one error for all its devices
                report.findings.append(finding)
        else:
            still = probe.take()
            device.latency = Latency.of(still.answered - still.asked)
            present[probe] = device, still
    # In lockstep the drives advance only together.
    if len(present) == len(report.devices) or machine.rig.clock == "real_time":
        report.findings += await _measure_cycles(list(present), report)
    for probe, (device, still) in present.items():
        report.findings += _check_device(
            probe, device, still, probe.take(), machine.rig, rate_hz, is_empty=is_empty
        )
    report.findings += _check_rates_equal([device for device, _ in present.values()])
    if machine.rig.sampling == "recorder" and not report.findings:
        report.findings += await check_rings(machine, list(present), rate_hz)
    return report


async def _connect(probes: Sequence[Probe]) -> dict[Line, DeviceError]:
    """Open all lines at once, since failures take time; return the errors of those that failed."""
    lines = list({probe.part.device.line: None for probe in probes})
    results = await asyncio.gather(*(line.connect() for line in lines), return_exceptions=True)
    lost = {}
    for line, error in zip(lines, results, strict=True):
        if isinstance(error, DeviceError):
            lost[line] = error
        elif error is not None:
            raise error
    return lost


async def _measure_device(probe: Probe, report: DeviceReport) -> None:
    """Read a device's identity, then its block many times."""
    # Readings of each device alone, and their longest duration.
    reads, reads_s = 200, 2.0
    device, loop = probe.part.device, asyncio.get_running_loop()
    report.connected = True
    for entry in probe.part.map.identity:
        (value,) = await device.read(
            entry.address, 1, function=entry.function or probe.part.reader.function
        )
        report.identity.append({"address": entry.address, "expected": entry.value, "found": value})
    await device.check_identity(probe.part.map.identity, probe.part.reader.function)
    until = loop.time() + reads_s
    for k in range(reads):
        if k and loop.time() > until:
            break
        await probe.read()


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
    assert report.latency
    seconds = float(series.answered[-1] - series.answered[0])
    if probe.in_lockstep and rate_hz:
        # In lockstep time is counted in samples: the computer's clock shows only how fast it
        # simulates.
        seconds = (len(series.asked) - 1) * probe.every / rate_hz
    elif rate_hz and report.latency.median_ms > 1e3 * SLOW * probe.every / rate_hz:
        findings.append(
            probe.finding(
                f"takes {report.latency.median_ms:.3g} ms to answer, too long for a sample of"
                f" {rate_hz:g} Hz ({probe.every * 1e3 / rate_hz:.3g} ms); give it a line of its"
                " own, raise its baud rate, or ask less often",
            )
        )
    if series is together:
        report.clock = measure_clock(probe, series, seconds)
        counts_hz = (
            rate_hz if rig.sampling == "cyclic" else rig.record_rate_hz if probe.is_drive else None
        )
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
