"""One run on a rig, from the first connection to the recording."""

import logging
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.loop import Loop
from pipelines.acquisition.machine.embedded_rig import embedded
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.machine.sampling import sampling_of
from pipelines.acquisition.modbus.exclusive_access import exclusive_access
from pipelines.acquisition.plan import check_start, check_trajectory, make_plan
from pipelines.acquisition.preconditions.feasible_rate import rate_checks
from pipelines.acquisition.preconditions.human_interlock import refuse_unguarded
from pipelines.acquisition.preconditions.rehearsal import refuse_unkept_rate
from pipelines.acquisition.preconditions.set_point_resolution import refuse_coarse_set_points
from pipelines.acquisition.preconditions.set_point_scale import refuse_contradictory_set_points
from pipelines.acquisition.progress import Progress, Report
from pipelines.acquisition.recording.columns import columns_of
from pipelines.acquisition.recording.journal import Journal
from pipelines.acquisition.recording.journal_file import refuse_leftover
from pipelines.acquisition.run_outcome import Outcome, finish_run, with_drive_state
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.acquisition.stop_signals import collected_signals, until_signal
from pipelines.acquisition.uninterrupted import run_to_its_end
from pipelines.contracts import RECORDING
from pipelines.contracts.atomic import open_folder
from pipelines.contracts.provenance import describe
from pipelines.contracts.run_paths import journal_of
from pipelines.errors import DeviceError, about
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.trajectory import Trajectory, read_trajectory
from pipelines.process.priority import urgent
from pipelines.settings.acquire import RunSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.settings.rig import RigSettings, load_rig

__all__ = ["Outcome", "acquire"]

Begin = Callable[[RigSettings, Trajectory], None]
"""Takes the rig with the limits in force, and the motion."""


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
        The recording. During the run its samples are in ``<output>.journal``. Those of a run that
        is stopped are left in ``<output stem>.aborted.parquet``, which make, too, takes for no
        whole recording.
    sample_rate_hz : float
        Rate at which the rig samples.
    mechanism : MechanismSettings, optional
        Geometry that the rig file does not hold.
    report : callable
        Called about ten times a second with the progress.
    reset_faults : bool
        Clear the faults that drives report before the run, with the rig file's control word.
    begin : callable
        Called with the rig and the motion once both are checked, before anything is connected. An
        error that it raises refuses the run.
    claim : callable
        Called once no other run can record to ``output`` any more, before anything moves. An error
        that it raises refuses the run.

    Returns
    -------
    Outcome
        Of a run that was recorded to its end.

    Raises
    ------
    ExoidError
        The run was refused or stopped; DeviceError where a device or a limit was the reason.
    """
    # All that the files alone can show is refused first, before any device is connected.
    described = load_rig(rig_path)
    if run.run == "with_human":
        with about(rig_path):
            # Before `in_force`, whose result holds the limits with a wearer under their common
            # names.
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
        # A recording's rate is that of its rows, not of the set-points.
        recorded_hz = sample_rate_hz * rig.samples_per_cycle(sample_rate_hz)
    metadata = _metadata(rig, run, trajectory, recorded_hz, mechanism or MechanismSettings())
    metadata |= {"trajectory": trajectory_path.name}
    config = {
        "run": run.model_dump(mode="json"),
        "acquire": {"sample_rate_hz": sample_rate_hz},
        "rig": rig.public(),
    }
    metadata |= describe([trajectory_path, rig_path], config)
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # our errors say it
    place = embedded(rig, rig_path, run, sample_rate_hz) if rig.embedded else nullcontext(rig)
    with (
        place as present,
        exclusive_access(present),
        nullcontext() if rig.clock == "lockstep" else urgent(),
        collected_signals() as stopped_by,
    ):
        sensors = present.sensor if run.run == "with_human" else ()
        supervisor = Supervisor(present, sample_rate_hz, sensors)
        recording = record_run(
            supervisor, run, trajectory, journal, metadata, report, stopped_by, reset_faults, claim
        )
        run_to_its_end(recording, supervisor.abort)
        # Within the block: a signal that comes now must not cut the recording short.
        return finish_run(output, journal, supervisor)


async def record_run(
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
    """Move the leg and write the journal, which ends with the reason of a stop.

    Raises
    ------
    DeviceError
        A device disagrees with the rig file, or the journal cannot be written.
    """
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
            await until_signal(refuse_unkept_rate(machine, supervisor.rate), stopped_by)
        sampling = sampling_of(machine, supervisor.rate, supervisor.check_records)
        # After the rehearsal, whose records must not be taken for those of the run.
        await until_signal(machine.empty_records(), stopped_by)
        try:
            with _opened(path, ["time_s", *columns_of(machine)], metadata) as journal:
                claim()
                loop = Loop(machine, supervisor, sampling, plan, journal, report, stopped_by)
                await loop.run()
                journal.end(supervisor.why, loop.metadata())
        except OSError as error:  # a full disk must not hide that a drive could not be disabled
            why = supervisor.why
            state = f". {with_drive_state(supervisor, why)}" if why else ""
            raise DeviceError(
                f"{path}: cannot be written ({error}); make room, then `exoid recover {path}` makes"
                f" a recording of its rows{state}"
            ) from error
    finally:
        machine.close()


def _opened(path: Path, columns: Sequence[str], metadata: dict[str, Any]) -> Journal:
    """Open the journal of a run; refuse one that another run has opened meanwhile."""
    try:
        return Journal(path, columns, metadata)
    except FileExistsError:
        refuse_leftover(path)
        raise


async def _ready(
    machine: Machine, rate_hz: float, reset_faults: bool, stopped_by: Sequence[str]
) -> NDArray:
    """Connect, make sure that every drive is idle, and return where the leg stands, (J,) rad."""
    await until_signal(machine.connect(), stopped_by)
    # Before anything is written, as a drive of another program must not be disturbed.
    await until_signal(machine.refuse_driven(), stopped_by)
    # Signals wait until every drive is idle, and no fault reset is left half way.
    if reset_faults:
        await machine.reset_faults()
    await machine.make_idle()
    await until_signal(machine.refuse_other_rate(rate_hz), stopped_by)
    start = np.array((await until_signal(machine.look(), stopped_by)).angle)
    check_start(machine.rig, start)
    return start


def _metadata(
    rig: RigSettings,
    run: RunSettings,
    trajectory: Trajectory,
    sample_rate_hz: float,
    mechanism: MechanismSettings,
) -> dict[str, Any]:
    """Return the recording's metadata; of a virtual rig's plant only measurable values."""
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
    if isinstance(trajectory, FourierTrajectory) and trajectory.has_detection_lines:
        metadata["excited_lines"] = trajectory.excited_lines
    return metadata
