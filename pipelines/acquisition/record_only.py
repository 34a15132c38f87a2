"""A recording of a machine that its own controller moves: exoid reads, and writes nothing to it.

The rows are numbered by the first device's counter, or by this computer's clock where it has none.
They have the time of that device's clock, or the middle between request and answer. The metadata
give the uncertainty of a row's time.
"""

import asyncio
import logging
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.acquisition.machine.read_only import ReadOnlyMachine, ReadOnlyRow
from pipelines.acquisition.machine.torn_words import TornRows
from pipelines.acquisition.machine.turns import LastingLeap
from pipelines.acquisition.misread import held, leaping, misread
from pipelines.acquisition.modbus.exclusive_access import exclusive_access
from pipelines.acquisition.modbus.file_lock import locked
from pipelines.acquisition.modbus.wraparound import CLOCK_TOLERANCE
from pipelines.acquisition.pacing import LEAN
from pipelines.acquisition.recording.journal import Journal
from pipelines.acquisition.recording.journal_file import refuse_leftover
from pipelines.acquisition.run_outcome import Outcome, record_journal
from pipelines.acquisition.stop_signals import collected_signals, until_signal
from pipelines.acquisition.uninterrupted import run_to_its_end
from pipelines.contracts import RECORDING
from pipelines.contracts.atomic import open_folder
from pipelines.contracts.provenance import describe
from pipelines.contracts.run_paths import journal_of
from pipelines.errors import DeviceError, ExoidError, SettingsError, about
from pipelines.process.priority import urgent
from pipelines.settings.acquire import RunSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.settings.rig.recording_only import RecordingRig, load_recording_rig
from pipelines.signals.power import absorbed_w

Report = Callable[[float, int], None]
"""Takes the time since the recording began, s, and the number of rows."""


def record_only(
    rig_path: Path,
    run: RunSettings,
    output: Path,
    sample_rate_hz: float,
    mechanism: MechanismSettings,
    report: Report = lambda seconds, rows: None,
    claim: Callable[[], None] = lambda: None,
) -> Outcome:
    """Record one run without moving anything.

    Parameters
    ----------
    rig_path : Path
        A recording-only rig file.
    run : RunSettings
        Its duration counts from the first row.
    output : Path
        The recording; its journal and its name after an early end are those of other runs.
    sample_rate_hz : float
        Rows a second; that of the first device's counter, where it has one.
    mechanism : MechanismSettings
        Joints and geometry.
    report : callable
        Called about once a second.
    claim : callable
        Called once no other run can record to ``output`` any more.

    Raises
    ------
    ExoidError
        The recording was refused or ended early; DeviceError where a device was the reason.
    """
    rig = load_recording_rig(rig_path)
    with about(rig_path):
        _refuse_other_joints(rig, mechanism)
    RECORDING.refuse_place(output)
    journal_path = journal_of(output)
    refuse_leftover(journal_path)
    open_folder(output.parent)
    metadata = _metadata(rig, run, mechanism, sample_rate_hz)
    metadata |= _provenance(rig_path, rig, run, sample_rate_hz)
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # our errors say it
    with exclusive_access(rig), urgent(), collected_signals() as stopped_by:
        turning = {joint.name for joint in mechanism.all_joints if joint.turns}
        recorder = _Recorder(rig, run, sample_rate_hz, turning, stopped_by, report)
        run_to_its_end(recorder.record(journal_path, metadata, claim), recorder.stop)
        with locked(journal_path) as lock:
            text = recorder.why or "the recording is complete"
            kind = DeviceError if recorder.fault is None else ExoidError
            return record_journal(output, lock, kind, text, recorder.fault)


def misread_values(path: Path, rig_path: Path) -> list[str]:
    """Return warnings of a recording's values that are possible one by one, but not in a row."""
    table, rig = RECORDING.read(path), load_recording_rig(rig_path)
    frame = table.frame
    time_s = frame["time_s"].to_numpy()
    channels: dict[str, list[str]] = {}
    for joint in rig.drive:
        for quantity, unit in (("angle", "rad"), ("torque", "nm"), ("current", "a")):
            register = getattr(rig.map.drive[joint.map].read, quantity, None)
            if register is None:
                continue
            column, where = f"{joint.joint}_{quantity}_{unit}", f"map.drive.{joint.map}.read"
            values = frame[column].to_numpy()
            texts = misread(quantity, register, f"{where}.{quantity}", values)
            moves = leaping(time_s, values) if quantity == "angle" and not register.turn else ()
            for text in (*texts, *held(time_s, values), *moves):
                channels.setdefault(text, []).append(column)
    warnings = [f"{path}: {', '.join(columns)}: {text}" for text, columns in channels.items()]
    warnings += [f"{path}: time_s: {text}" for text in _other_rate(table.metadata, rig, time_s)]
    if table.metadata["run"] == "exo_alone":  # a person may move the drives
        warnings += [f"{path}: {text}" for text in _absorbed(frame, rig)]
    return warnings


def _other_rate(metadata: Mapping[str, Any], rig: RecordingRig, time_s: NDArray) -> Iterator[str]:
    """Yield that the device's clock is faster or slower than any clock: its unit or scale is."""
    reading = metadata.get("reading", {})
    rate = reading.get("clock_rate", 1.0)
    # Each end is uncertain by a sample and by the time of a request.
    end_s = 1.0 / metadata["sample_rate_hz"] + reading.get("uncertainty_longest_s", 0.0)
    seconds = float(time_s[-1] - time_s[0]) / rate
    where = rig.drive[0].map
    register = rig.map.drive[where].read.time
    if register is not None and abs(rate - 1.0) * seconds > CLOCK_TOLERANCE * seconds + 2.0 * end_s:
        yield (
            f"the device's clock goes on by {rate:.4g} s in each second of this computer's;"
            f" compare map.drive.{where}.read.time with the manual: scale ="
            f" {register.scale / rate:.3g} would agree"
        )


def _absorbed(frame: pd.DataFrame, rig: RecordingRig) -> Iterator[str]:
    """Yield that the drives take up energy on average."""
    names = [("time_s", f"{j.joint}_angle_rad", f"{j.joint}_torque_nm") for j in rig.drive]
    absorbed = absorbed_w(tuple(frame[name].to_numpy() for name in own) for own in names)
    if absorbed is not None:
        yield (
            f"the drives absorb {absorbed:.3g} W on average, but friction must consume power; check"
            " the signs of angles and torques (scale, direction)"
        )


def _refuse_other_joints(rig: RecordingRig, mechanism: MechanismSettings) -> None:
    """Refuse joints that are not those of the experiment's mechanism, or that slide."""
    recorded, expected = [joint.joint for joint in rig.drive], mechanism.all_joints
    if recorded != [joint.name for joint in expected]:
        raise SettingsError(
            f"drive: found joints {', '.join(recorded)}, expected those of [mechanism]:"
            f" {', '.join(joint.name for joint in expected)}"
        )
    for recorded_joint, joint in zip(rig.drive, expected, strict=True):
        if rig.map.drive[recorded_joint.map].read.angle.turn and not joint.turns:
            raise SettingsError(
                f"drive: the angle of {joint.name} has wraps_at; set turns = true at that joint in"
                " [mechanism]"
            )
        if joint.kind != "revolute":
            raise SettingsError(
                f"drive: {joint.name} slides, and only turning joints are recorded; use"
                " `exoid import` for its log"
            )


def _metadata(
    rig: RecordingRig, run: RunSettings, mechanism: MechanismSettings, sample_rate_hz: float
) -> dict[str, Any]:
    loops = {name: loop.model_dump(exclude_none=True) for name, loop in rig.controller.items()}
    return {
        "run": run.run,
        "purpose": run.purpose,
        "sample_rate_hz": sample_rate_hz,
        "rig": rig.name,
        "recording_only": True,
        "controller": loops,
        "geometry": mechanism.geometry | rig.geometry.model_dump(exclude_none=True),
        "joints": [joint.metadata for joint in mechanism.all_joints],
    }


def _provenance(
    rig_path: Path, rig: RecordingRig, run: RunSettings, sample_rate_hz: float
) -> dict[str, Any]:
    """Return the hash of the rig file and the settings in force."""
    config = {
        "run": run.model_dump(mode="json"),
        "acquire": {"sample_rate_hz": sample_rate_hz},
        "rig": rig.public(),
    }
    return describe([rig_path], config)


class _Recorder:
    """One recording while it goes on."""

    def __init__(
        self,
        rig: RecordingRig,
        run: RunSettings,
        rate_hz: float,
        turning: Collection[str],
        stopped_by: Sequence[str],
        report: Report,
    ) -> None:
        self._rig, self._turning = rig, turning
        self._rate_hz, self._planned = rate_hz, round(run.duration_s * rate_hz)
        self._watchdog_s = rig.safety.watchdog_s
        self._stopped_by, self._report = stopped_by, report
        self._torn_rows = 0
        self._clock = _ClockRate()
        self._widths: list[float] = []
        """Time from the first request of a row to its last answer, s."""
        self.why: str | None = None
        """Why it ended early."""
        self.fault: BaseException | None = None
        """An error of exoid's own that ended it."""

    def stop(self, error: BaseException) -> None:
        """End with a reason; the first one counts."""
        if self.why is None:
            self.why = str(error) or type(error).__name__
            self.fault = None if isinstance(error, DeviceError | KeyboardInterrupt) else error

    async def record(self, path: Path, metadata: dict[str, Any], claim: Callable[[], None]) -> None:
        """Connect, then write every row to the journal, which ends with the reason of a stop."""
        machine = ReadOnlyMachine(self._rig, self._rate_hz, self._turning)
        try:
            await until_signal(machine.connect(), self._stopped_by)
            with Journal(path, ["time_s", *machine.columns, "sequence"], metadata) as journal:
                claim()
                try:
                    await self._follow(machine, journal)
                except BaseException as error:
                    self.stop(error)
                journal.end(self.why, {"reading": self._reading(machine)})
        finally:
            machine.close()

    async def _follow(self, machine: ReadOnlyMachine, journal: Journal) -> None:
        """Read rows until the last one is written; one that cannot be read is left out."""
        pace = (_CounterPace if machine.has_counter else _HostPace)(self._rate_hz)
        answered_at = reported_at = time.monotonic()
        number, fault = -1, None
        long = machine.long_integers()
        torn = TornRows[list[float]](list(long), list(long.values()))
        leaps = {at: LastingLeap() for at in machine.angles_that_go_on()}
        while number < self._planned - 1:
            await pace.wait()
            if self._stopped_by:
                raise DeviceError(f"stopped by {self._stopped_by[0]}")
            try:
                row = await machine.row()
            except DeviceError as error:  # nothing moves, so a fault costs rows only
                fault = error
            else:
                at, seconds = pace.place(row)
                self._clock.take(row)
                if at > number:
                    number, answered_at, fault = at, time.monotonic(), None
                    if number < self._planned:
                        for whole in self._whole(row, number, seconds, torn):
                            _refuse_leap(whole, leaps, machine)
                            journal.append(whole)
            now = time.monotonic()
            if now - answered_at > self._watchdog_s:
                raise self._expired(now - answered_at, fault, machine)
            if now - reported_at >= 1.0:
                reported_at = now
                self._report((number + 1) / self._rate_hz, journal.rows)

    def _whole(
        self, row: ReadOnlyRow, number: int, seconds: float, torn: TornRows[list[float]]
    ) -> list[list[float]]:
        """Note how long a row took; return the rows that are known to be whole now it has come."""
        self._widths.append(row.answered - row.asked)
        whole = torn.take([seconds, *row.values, number], number, row.values)
        self._torn_rows = torn.torn
        return whole

    def _expired(
        self, waited_s: float, fault: DeviceError | None, machine: ReadOnlyMachine
    ) -> DeviceError:
        """Return the watchdog's error, with the last fault if there was one."""
        allowed = f"for {waited_s:.3g} s, allowed are {self._watchdog_s:g} s (safety.watchdog_s)"
        if fault is not None:
            return DeviceError(f"watchdog: no whole row {allowed}: {fault}")
        return DeviceError(
            f"watchdog: no new sample from {machine.parts[0].device.label} {allowed}: its counter"
            " stands still; check that the machine runs"
        )

    def _reading(self, machine: ReadOnlyMachine) -> dict[str, Any]:
        """Return how rows were timed, for the recording's metadata."""
        clock = "device" if machine.has_clock else "host"
        if not self._widths:
            return {"clock": clock, "torn_rows": self._torn_rows}
        # The sample was taken at an unknown instant between request and answer.
        median, p99, longest = (0.5 * np.quantile(self._widths, [0.5, 0.99, 1.0])).tolist()
        return {
            "clock": clock,
            "torn_rows": self._torn_rows,
            "uncertainty_median_s": median,
            "uncertainty_p99_s": p99,
            "uncertainty_longest_s": longest,
        } | self._clock.metadata


def _refuse_leap(
    row: Sequence[float], leaps: Mapping[int, LastingLeap], machine: ReadOnlyMachine
) -> None:
    """End a recording in which an angle has started again, which the rig file does not say."""
    for at, lasting in leaps.items():
        leap = lasting.take(int(row[-1]), row[1 + at])
        if leap is not None:
            raise DeviceError(
                f"{machine.columns[at]} leaps by {leap:.4g} rad from one row to the next and goes"
                " on from there: its register starts again after a turn; set read.angle.wraps_at"
                " in the rig file, in counts, and turns = true in [mechanism]"
            )


class _ClockRate:
    """How fast the first device's clock goes, from the first row to the last."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, float]] = []
        """Device's and host's time of the first and the last row, s."""

    def take(self, row: ReadOnlyRow) -> None:
        """Note a row's times."""
        if row.time is not None:
            self._rows = [*self._rows[:1], (row.time, 0.5 * (row.asked + row.answered))]

    @property
    def metadata(self) -> dict[str, float]:
        """The device's seconds in one of the host's; empty without a clock."""
        if len(self._rows) < 2:
            return {}
        (device, host), (device_end, host_end) = self._rows
        return {"clock_rate": (device_end - device) / (host_end - host)}


class _HostPace:
    """Rows by this computer's clock, which begins with the first one."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._began: float | None = None
        self._next = 1

    async def wait(self) -> None:
        """Wait until the next row is due; those that are late are left out."""
        if self._began is None:
            return
        passed = (time.perf_counter() - self._began) * self._rate_hz
        self._next = max(self._next, int(np.ceil(passed)))
        await asyncio.sleep((self._next - passed) / self._rate_hz)
        self._next += 1

    def place(self, row: ReadOnlyRow) -> tuple[int, float]:
        """Return the number and the time (s) of a row."""
        middle = 0.5 * (row.asked + row.answered)
        if self._began is None:
            self._began = middle
        return round((middle - self._began) * self._rate_hz), middle - self._began


class _CounterPace:
    """Rows by the first device's counter: each is read soon after the device's new sample.

    Requests lean a little towards the instant of the sample. One that comes too early finds the
    sample before, and is repeated a little later.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period = 1.0 / rate_hz
        self._due = time.perf_counter()
        self._first: tuple[int, float] | None = None
        self._last: int | None = None

    async def wait(self) -> None:
        """Wait until the device should have a new sample."""
        await asyncio.sleep(max(0.0, self._due - time.perf_counter()))
        self._due = time.perf_counter() + (1.0 - LEAN) * self._period

    def place(self, row: ReadOnlyRow) -> tuple[int, float]:
        """Return the number and the time (s) of a row."""
        # Share of a period to wait after a row that was read too early.
        step_back = 0.1
        assert row.sequence is not None  # the device has a counter
        if row.sequence == self._last:
            self._due = row.answered + step_back * self._period
        self._last = row.sequence
        seconds = row.time if row.time is not None else 0.5 * (row.asked + row.answered)
        self._first = self._first or (row.sequence, seconds)
        return row.sequence - self._first[0], seconds - self._first[1]
