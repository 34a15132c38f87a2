"""One run on a rig, from the first connection to the recording."""

import asyncio
import logging
import signal
import traceback
from collections.abc import Callable, Coroutine, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.loop import Loop
from pipelines.acquisition.machine.embedded_rig import embedded
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.machine.sampling import sampling_of
from pipelines.acquisition.modbus.exclusive_access import exclusive_access
from pipelines.acquisition.modbus.file_lock import Lock, locked
from pipelines.acquisition.pacing import urgent
from pipelines.acquisition.plan import check_start, check_trajectory, make_plan
from pipelines.acquisition.preconditions.feasible_rate import rate_checks
from pipelines.acquisition.preconditions.human_interlock import refuse_unguarded
from pipelines.acquisition.preconditions.rehearsal import refuse_unkept_rate
from pipelines.acquisition.preconditions.set_point_resolution import refuse_coarse_set_points
from pipelines.acquisition.preconditions.set_point_scale import refuse_contradictory_set_points
from pipelines.acquisition.progress import Progress, Report
from pipelines.acquisition.recording.columns import columns_of
from pipelines.acquisition.recording.journal import Journal
from pipelines.acquisition.recording.journal_file import JournalFile, refuse_leftover
from pipelines.acquisition.recording.recording import recording_path, summarize, write_recording
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.acquisition.states import State
from pipelines.acquisition.uninterrupted import run_to_its_end
from pipelines.contracts import RECORDING
from pipelines.contracts.atomic import open_folder
from pipelines.contracts.provenance import describe
from pipelines.contracts.run_paths import journal_of
from pipelines.errors import DeviceError, ExoidError, about
from pipelines.mechanics.trajectory import Trajectory, read_trajectory
from pipelines.process.termination import ENDING, handled, known
from pipelines.settings.acquire import RunSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.settings.rig import RigSettings, load_rig

Begin = Callable[[RigSettings, Trajectory], None]
T = TypeVar("T")
SIGNAL_POLL_S = 0.05
"""How often it is looked for signals while devices are waited for before anything moves."""


@dataclass(frozen=True)
class Outcome:
    """What a whole run left."""

    path: Path
    samples: int
    missed: int
    left_out: int
    """Set-points that were left out, from the way to its beginning to that from its end."""


def acquire(
    rig_path: Path,
    run: RunSettings,
    trajectory_path: Path,
    output: Path,
    sample_rate_hz: float = 200.0,
    mechanism: MechanismSettings | None = None,
    report: Report = lambda progress: None,
    *,
    reset_faults: bool = False,
    begin: Begin = lambda rig, trajectory: None,
    claim: Callable[[], None] = lambda: None,
) -> Outcome:
    """Record one run.

    Parameters
    ----------
    rig_path, trajectory_path : Path
        The rig's description; the excitation, ``trajectory/1`` or TOML.
    run : RunSettings
    output : Path
        The recording. While it is being made, its samples are in ``<output>.journal``. A run that
        is stopped raises DeviceError and leaves what there is in ``<output stem>.aborted.parquet``,
        so that nobody, make included, takes it for a whole one.
    sample_rate_hz : float
        Rate at which the rig samples.
    mechanism : MechanismSettings, optional
        Geometry, where the rig file does not say it.
    report : callable
        Called about ten times a second with the progress.
    reset_faults : bool
        Clear the faults that drives report before the run, with the control word that the rig file
        has for it.
    begin : callable
        Told the rig with the limits in force and the motion, both found fit, before anything is
        connected; what it raises refuses the run.
    claim : callable
        Called once no other run can record to ``output`` any more, before anything moves; what it
        raises refuses the run.
    """
    described = load_rig(rig_path)
    if run.run == "with_human":
        with about(rig_path):
            refuse_unguarded(described, sample_rate_hz)
    rig = described.in_force(run.run)
    trajectory = read_trajectory(trajectory_path)
    with about(trajectory_path):
        check_trajectory(rig, trajectory, run.duration_s, sample_rate_hz)
    with about(rig_path):
        refuse_coarse_set_points(rig, sample_rate_hz)
        refuse_contradictory_set_points(rig)
    if rig.clock == "real_time":
        with about(rig_path):
            for refuse in rate_checks(with_sensors=run.run == "with_human"):
                refuse(rig, sample_rate_hz)
    RECORDING.refuse_place(output)
    journal = journal_of(output)
    refuse_leftover(journal)
    begin(rig, trajectory)
    open_folder(output.parent)
    with about(rig_path):
        recorded_hz = sample_rate_hz * rig.samples_per_cycle(sample_rate_hz)
    metadata = _metadata(rig, run, trajectory, recorded_hz, mechanism or MechanismSettings())
    metadata |= {"trajectory": trajectory_path.name}
    config = {
        "run": run.model_dump(mode="json"),
        "acquire": {"sample_rate_hz": sample_rate_hz},
        "rig": rig.public(),
    }
    metadata |= describe([trajectory_path, rig_path], config)
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # what it would print, our errors say
    place = embedded(rig, rig_path, run, sample_rate_hz) if rig.embedded else nullcontext(rig)
    with (
        place as present,
        exclusive_access(present),
        nullcontext() if rig.clock == "lockstep" else urgent(),
        _signals() as stopped_by,
    ):
        sensors = present.sensor if run.run == "with_human" else ()
        supervisor = Supervisor(present, sample_rate_hz, sensors)
        recording = _record(
            supervisor, run, trajectory, journal, metadata, report, stopped_by, reset_faults, claim
        )
        run_to_its_end(recording, supervisor.abort)
        return _finish(output, journal, supervisor)


async def _record(
    supervisor: Supervisor,
    run: RunSettings,
    trajectory: Trajectory,
    path: Path,
    metadata: dict[str, Any],
    report: Report,
    stopped_by: Sequence[str],
    reset_faults: bool,
    claim: Callable[[], None],
) -> None:
    """Move the leg and write the journal, which says at its end why the run was stopped early, if
    it was."""
    rig = supervisor.rig
    with_human = run.run == "with_human"
    machine = Machine(rig, with_sensors=with_human, samples_per_cycle=supervisor.samples_per_cycle)
    report(Progress(duration_s=run.duration_s))
    try:
        supervisor.start_checks()
        start = await _ready(machine, supervisor.rate, reset_faults, stopped_by)
        plan = make_plan(rig, trajectory, start, run.duration_s, supervisor.rate)
        supervisor.load_plan(plan, start)
        if rig.clock == "real_time":
            await _until_signal(refuse_unkept_rate(machine, supervisor.rate), stopped_by)
        sampling = sampling_of(machine, supervisor.rate, supervisor.check_records)
        await _until_signal(machine.empty_records(), stopped_by)
        try:
            with _opened(path, ["time_s", *columns_of(machine)], metadata) as journal:
                claim()
                loop = Loop(machine, supervisor, sampling, plan, journal, report, stopped_by)
                await loop.run()
                journal.end(supervisor.why, loop.metadata())
        except OSError as error:  # a full disk must not hide that a drive could not be disabled
            why = supervisor.why
            state = f". {_with_drive_state(supervisor, why)}" if why else ""
            raise DeviceError(
                f"{path}: cannot be written ({error}); make room, then `exoid recover {path}` makes"
                f" a recording of its rows{state}"
            ) from error
    finally:
        machine.close()


def _opened(path: Path, columns: Sequence[str], metadata: dict[str, Any]) -> Journal:
    """Open the journal of a run; refuse where another run has opened it since it was looked for."""
    try:
        return Journal(path, columns, metadata)
    except FileExistsError:
        refuse_leftover(path)
        raise


async def _ready(
    machine: Machine, rate_hz: float, reset_faults: bool, stopped_by: Sequence[str]
) -> NDArray:
    """Connect, make sure that every drive is idle, and return where the leg stands, (J,) rad."""
    await _until_signal(machine.connect(), stopped_by)
    await _until_signal(machine.refuse_driven(), stopped_by)
    # Whatever comes meanwhile: each drive is to note that it shall be idle, and no fault reset is
    # left half way.
    if reset_faults:
        await machine.reset_faults()
    await machine.make_idle()
    await _until_signal(machine.refuse_other_rate(rate_hz), stopped_by)
    start = np.array((await _until_signal(machine.look(), stopped_by)).angle)
    if why := check_start(machine.rig, start):
        raise DeviceError(why)
    return start


async def _until_signal(work: Coroutine[Any, Any, T], stopped_by: Sequence[str]) -> T:
    """Return what work comes to that only asks, and leave off at a signal however long a device is
    waited for."""
    task = asyncio.ensure_future(work)
    try:
        while not task.done():
            await asyncio.wait([task], timeout=SIGNAL_POLL_S)
            if stopped_by:
                raise DeviceError(
                    f"stopped by {stopped_by[0]} before the drives were enabled; nothing was moved"
                )
    except BaseException:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        raise
    return task.result()


@contextmanager
def _signals() -> Iterator[list[str]]:
    """Collect the names of signals that ask for a stop, so that the loop and nothing else acts on
    them.

    One that came too late to stop this run acts at its end: no other run is to begin after it.
    """
    # A terminal that is closed must not leave a drive enabled either.
    # Ctrl-Z would leave it to the drives' own watchdogs to stop the leg.
    names = known({**ENDING, "SIGTSTP": "Ctrl-Z"})
    came, late = list[str](), list[signal.Signals]()

    def note(number: int, frame: FrameType | None) -> None:
        late.append(signal.Signals(number))
        came.append(names[late[-1]])

    with handled(names, note):
        yield came
    for number in late[:1]:
        signal.raise_signal(number)


def _ending(output: Path, supervisor: Supervisor) -> tuple[type[ExoidError], str]:
    """Return whose fault the end of a run is, and in words how it ended and how it left the leg."""
    if supervisor.fault:
        log = _keep_traceback(supervisor.fault, recording_path(output, supervisor.why))
        return ExoidError, _with_drive_state(
            supervisor, f"{supervisor.why}; please report it with {log}"
        )
    return DeviceError, (
        _with_drive_state(supervisor, supervisor.why) if supervisor.why else "the run is complete"
    )


def _finish(output: Path, journal: Path, supervisor: Supervisor) -> Outcome:
    """Turn the journal into a recording; raise where the run was stopped, or exoid was at fault."""
    kind, text = _ending(output, supervisor)
    with ExitStack() as held:
        try:
            lock = held.enter_context(locked(journal))
        except OSError as error:
            raise kind(
                f"{text}; its samples are not in {journal} any more ({error.strerror}); where that"
                " was moved to, `exoid recover` makes a recording of it"
            ) from error
        return _recorded(output, lock, kind, text, supervisor.fault)


def _recorded(
    output: Path, lock: Lock, kind: type[ExoidError], text: str, fault: BaseException | None
) -> Outcome:
    """Write the recording and remove the journal; raise what was ``told`` where the run was stopped
    early."""
    path = lock.path
    try:
        journal = JournalFile(path)
        summary = summarize(journal)
        place, samples = recording_path(output, summary.abort), summary.samples
        if samples or not (summary.abort or summary.damaged):
            write_recording(journal, place, summary)
    except (ExoidError, OSError) as error:
        raise kind(
            f"{text}; its samples are in {path}, but could not be written as a recording: {error};"
            f" once that is mended, `exoid recover {path}` makes one"
        ) from error
    if summary.damaged:
        state_of_drives = (
            f"{samples} samples are in {place}, but"
            if samples
            else "no sample of it can be read, since"
        )
        raise kind(
            f"{text}; {state_of_drives} the disk did not give back all that was written; check the"
            f" disk, {path} is kept"
        ) from fault
    lock.remove()
    if summary.abort:
        rest = (
            f", its {samples} samples so far are in {place}"
            if samples
            else " before the recording began"
        )
        raise kind(text + rest) from fault
    return Outcome(
        place, samples, summary.missed, summary.metadata.get("latency", {}).get("left_out", 0)
    )


def _with_drive_state(supervisor: Supervisor, why: str) -> str:
    """Return why a run was stopped, with how that has left the leg; what somebody must do at once
    comes first."""
    return (
        f"{why}; the leg was stopped"
        if supervisor.state is State.DISABLED
        else f"USE THE EMERGENCY STOP: {why}"
    )


def _keep_traceback(fault: BaseException, recording: Path) -> str:
    """Write the traceback of a fault of exoid's own beside a recording; return where."""
    log = recording.with_suffix(".log")
    try:
        with open(log, "a", encoding="utf-8") as file:
            file.writelines(traceback.format_exception(fault))
    except OSError as error:
        return f"this, as {log} cannot be written: {error}"
    return str(log)


def _metadata(
    rig: RigSettings,
    run: RunSettings,
    trajectory: Trajectory,
    sample_rate_hz: float,
    mechanism: MechanismSettings,
) -> dict[str, Any]:
    """Return what the recording knows of itself; nothing of a virtual rig's plant but what a user
    would measure."""
    metadata: dict[str, Any] = {
        "run": run.run,
        "purpose": run.purpose,
        "sample_rate_hz": sample_rate_hz,
        "rig": rig.name,
        "controller": rig.known_controllers(),
        "geometry": mechanism.geometry | rig.known_geometry(),
    }
    if trajectory.period_s:
        metadata["period_s"] = trajectory.period_s
    return metadata
