"""The end of a run: its journal becomes a recording, or an error says how the run ended."""

import traceback
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from pipelines.acquisition.modbus.file_lock import Lock, locked
from pipelines.acquisition.recording.journal_file import JournalFile
from pipelines.acquisition.recording.recording import recording_path, summarize, write_recording
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.acquisition.states import State
from pipelines.errors import DeviceError, ExoidError


@dataclass(frozen=True)
class Outcome:
    """A run that was recorded to its end."""

    path: Path
    samples: int
    missed: int
    left_out: int
    """Set-points that were not sent because samples came late, ramps included."""


def finish_run(output: Path, journal: Path, supervisor: Supervisor) -> Outcome:
    """Turn the journal of a run into its recording.

    Raises
    ------
    DeviceError
        The run was stopped early, or its samples could not be written.
    ExoidError
        An error of exoid's own stopped the run.
    """
    kind, text = _error_of(output, supervisor)
    with ExitStack() as held:
        try:
            lock = held.enter_context(locked(journal))
        except OSError as error:
            raise kind(
                f"{text}; its samples are not in {journal} any more ({error.strerror}); where that"
                " was moved to, `exoid recover` makes a recording of it"
            ) from error
        if not lock.free:
            raise kind(
                f"{text}; another process is making a recording of {journal} now; wait for its end"
            )
        return record_journal(output, lock, kind, text, supervisor.fault)


def with_drive_state(supervisor: Supervisor, why: str) -> str:
    """Return why a run was stopped, with the state of the drives; an emergency comes first."""
    if supervisor.state is State.DISABLED:
        return f"{why}; the leg was stopped"
    return f"USE THE EMERGENCY STOP: {why}"


def record_journal(
    output: Path, lock: Lock, kind: type[ExoidError], text: str, fault: BaseException | None
) -> Outcome:
    """Write the recording of a locked journal, and remove the journal.

    Parameters
    ----------
    output : Path
        The recording of a whole run.
    lock : Lock
        Of the journal.
    kind, text, fault
        The error to raise where the run was stopped early or the journal is damaged: its kind, how
        the run ended, and the error of exoid's own that is its cause, if any.
    """
    path = lock.path
    try:
        journal = JournalFile(path)
        summary = summarize(journal)
        place, samples = recording_path(output, summary.abort), summary.samples
        # A run that was stopped before its first sample leaves no empty recording.
        if samples or not (summary.abort or summary.damaged):
            write_recording(journal, place, summary)
    except (ExoidError, OSError) as error:
        raise kind(
            f"{text}; its samples are in {path}, but could not be written as a recording: {error};"
            f" once that is mended, `exoid recover {path}` makes one"
        ) from error
    if summary.damaged:
        remaining = "no sample of it can be read, since"
        if samples:
            remaining = f"{samples} samples are in {place}, but"
        raise kind(
            f"{text}; {remaining} the disk did not give back all that was written; check the"
            f" disk, {path} is kept"
        ) from fault
    lock.remove()
    if summary.abort:
        where = " before the recording began"
        if samples:
            where = f", its {samples} samples so far are in {place}"
        raise kind(text + where) from fault
    left_out = summary.metadata.get("latency", {}).get("left_out", 0)
    return Outcome(place, samples, summary.missed, left_out)


def _error_of(output: Path, supervisor: Supervisor) -> tuple[type[ExoidError], str]:
    """Return the kind of error to raise, and a text with the run's end and the drives' state."""
    if supervisor.fault:
        log = _write_traceback(supervisor.fault, recording_path(output, supervisor.why))
        why = f"{supervisor.why}; please report it with {log}"
        return ExoidError, with_drive_state(supervisor, why)
    if supervisor.why:
        return DeviceError, with_drive_state(supervisor, supervisor.why)
    return DeviceError, "the run is complete"


def _write_traceback(fault: BaseException, recording: Path) -> str:
    """Write the traceback of an error of exoid's own next to a recording; return where."""
    log = recording.with_suffix(".log")
    try:
        with open(log, "a", encoding="utf-8") as file:
            file.writelines(traceback.format_exception(fault))
    except OSError as error:
        return f"this, as {log} cannot be written: {error}"
    return str(log)
