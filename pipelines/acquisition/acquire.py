"""One run on a rig, from the first connection to the recording."""

import asyncio
import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.acquisition.columns import columns_of
from pipelines.acquisition.embedded import embedded
from pipelines.acquisition.journal import Journal, JournalFile, journal_of, locked, refuse_leftover
from pipelines.acquisition.loop import Loop, Progress, Report
from pipelines.acquisition.machine import Machine
from pipelines.acquisition.pace import urgent
from pipelines.acquisition.plan import check_start, check_trajectory, make_plan
from pipelines.acquisition.recorded import account_of, place_for, write_recording
from pipelines.contracts import RECORDING
from pipelines.contracts.provenance import describe
from pipelines.errors import DeviceError, ExoidError, about
from pipelines.mechanics.trajectory import Trajectory, read_trajectory
from pipelines.settings.acquire import RunSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.settings.rig import RigSettings, load_rig


@dataclass(frozen=True)
class Outcome:
    """What a whole run left."""

    path: Path
    samples: int
    missed: int


def acquire(
    rig_path: Path,
    run: RunSettings,
    trajectory_path: Path,
    output: Path,
    sample_rate_hz: float = 200.0,
    mechanism: MechanismSettings | None = None,
    report: Report = lambda progress: None,
) -> Outcome:
    """Record one run.

    Parameters
    ----------
    rig_path, trajectory_path : Path
        The rig's description; the excitation, ``trajectory/1`` or TOML.
    run : RunSettings
    output : Path
        The recording. While it is being made, its samples are in ``<output>.journal``. A run that is stopped
        raises DeviceError and leaves what there is in ``<output stem>.aborted.parquet``, so that nobody, make
        included, takes it for a whole one.
    sample_rate_hz : float
        Rate at which the rig samples.
    mechanism : MechanismSettings, optional
        Geometry, where the rig file does not say it.
    report : callable
        Called about ten times a second with the progress.
    """
    rig = load_rig(rig_path)
    trajectory = read_trajectory(trajectory_path)
    with about(trajectory_path):
        check_trajectory(rig, trajectory, run.duration_s, sample_rate_hz)
    RECORDING.refuse_place(output)
    journal = journal_of(output)
    refuse_leftover(journal)
    metadata = _metadata(rig, run, trajectory, sample_rate_hz, mechanism or MechanismSettings())
    metadata |= {"trajectory": trajectory_path.name}
    metadata |= describe([trajectory_path, rig_path], {"run": run.model_dump(mode="json"), "rig": rig.public()})
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # what it would print, our errors say
    place = embedded(rig, rig_path, run, sample_rate_hz) if rig.embedded else nullcontext(rig)
    with place as present, nullcontext() if rig.clock == "lockstep" else urgent():
        asyncio.run(_record(present, run, trajectory, journal, metadata, sample_rate_hz, report))
    with locked(journal):
        return _finish(output, journal)


async def _record(
    rig: RigSettings,
    run: RunSettings,
    trajectory: Trajectory,
    path: Path,
    metadata: dict[str, Any],
    rate: float,
    report: Report,
) -> None:
    """Move the leg and write the journal, which says at its end why the run was stopped early, if it was."""
    machine = Machine(rig, with_sensors=run.run == "with_human")
    report(Progress(duration_s=run.duration_s))
    with _signals() as stopped_by:
        try:
            await machine.connect()
            start = np.array((await machine.look()).angle)
            if why := check_start(rig, start):
                raise DeviceError(why)
            plan = make_plan(rig, trajectory, start, run.duration_s, rate)
            abort = None
            try:
                with Journal(path, ["time_s", *columns_of(machine)], metadata) as journal:
                    loop = Loop(machine, plan, journal, rate, report, stopped_by, sent=start)
                    abort = await loop.run()
                    journal.end(abort)
            except OSError as error:  # a full disk must not hide that a drive could not be disabled
                raise DeviceError(
                    f"{path}: cannot be written ({error}); make room, then `exoid recover {path}` makes a recording "
                    f"of what is in it{f'. {abort}' if abort else ''}"
                ) from error
        finally:
            machine.close()


@contextmanager
def _signals() -> Iterator[list[str]]:
    """Collect the names of signals that ask for a stop, so that the loop and nothing else acts on them."""
    # A terminal that is closed must not leave a drive enabled either.
    names = {signal.SIGINT: "Ctrl-C", signal.SIGTERM: "SIGTERM", signal.SIGHUP: "SIGHUP", signal.SIGQUIT: "SIGQUIT"}
    loop, came = asyncio.get_running_loop(), list[str]()
    # Outside a process's main thread nobody can catch signals, and nobody is sent them.
    with suppress(NotImplementedError, RuntimeError, ValueError):
        for number, name in names.items():
            loop.add_signal_handler(number, came.append, name)
    try:
        yield came
    finally:
        with suppress(NotImplementedError, RuntimeError, ValueError):
            for number in names:
                loop.remove_signal_handler(number)


def _finish(output: Path, path: Path) -> Outcome:
    """Turn the journal into a recording; raise DeviceError where the run was stopped."""
    journal = JournalFile(path)
    account = account_of(journal)
    abort, samples = account.abort, account.samples
    if abort and not samples:
        path.unlink()
        raise DeviceError(f"{abort}; the leg was stopped before the recording began")
    place = place_for(output, abort)
    try:
        write_recording(journal, place, account)
    except (ExoidError, OSError) as error:
        raise DeviceError(
            f"{abort or 'the run is complete'}; its {samples} samples are in {path}, but could not be written as a "
            f"recording: {error}; once that is mended, `exoid recover {path}` makes one"
        ) from error
    path.unlink()
    if abort:
        raise DeviceError(f"{abort}; the leg was stopped, its {samples} samples so far are in {place}")
    return Outcome(place, samples, account.missed)


def _metadata(
    rig: RigSettings, run: RunSettings, trajectory: Trajectory, sample_rate_hz: float, mechanism: MechanismSettings
) -> dict[str, Any]:
    """Return what the recording knows of itself; nothing of a virtual rig's plant but what a user would measure."""
    metadata: dict[str, Any] = {
        "run": run.run,
        "purpose": run.purpose,
        "sample_rate_hz": sample_rate_hz,
        "rig": rig.name,
        "controller": rig.known_controllers(),
        "geometry": mechanism.model_dump() | rig.known_geometry(),
    }
    if trajectory.period_s:
        metadata["period_s"] = trajectory.period_s
    return metadata
