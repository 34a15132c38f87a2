"""The folder of an investigation: a folder for each step, with the motion that it adds.

``investigation/K`` holds what made step K: the verdict before it, and the motion that was designed
to end its doubt. Every [[run]] is repeated along the motion, as run ``NAME+K`` of the experiment.
"""

from itertools import chain, count, takewhile
from pathlib import Path

from pipelines.contracts.provenance import metadata_of
from pipelines.contracts.verdict import Verdict, read
from pipelines.errors import ContractError, InputError
from pipelines.settings.acquire import RunSettings, step_of
from pipelines.settings.experiment import Experiment
from pipelines.workflow.imported import ImportedRuns


def step_folder(out: Path, step: int) -> Path:
    """Return the folder of a step, the first is 1, in the folder of an experiment's results."""
    return out / "investigation" / str(step)


def motion_of(out: Path, step: int) -> Path:
    """Return the file of the motion that a step adds."""
    return step_folder(out, step) / "trajectory.parquet"


def verdict_before(out: Path, step: int) -> Path:
    """Return the file of the verdict from which a step's motion was designed."""
    return step_folder(out, step) / "verdict.json"


def verdicts_before_steps(out: Path) -> list[Path]:
    """Return the verdicts from which the steps' motions were designed, in the steps' order."""
    return [verdict_before(out, step) for step in range(1, last_step(out) + 1)]


def last_step(out: Path) -> int:
    """Return the number of steps that have a motion."""
    return sum(1 for _ in takewhile(lambda step: motion_of(out, step).is_file(), count(1)))


def motions_of(experiment: Experiment, out: Path, last: int | None = None) -> list[Path]:
    """Return the motions of an experiment: those of its own runs, and that of each step.

    Parameters
    ----------
    experiment : Experiment
        A run of it may have an excitation of its own.
    out : Path
        Folder of the results.
    last : int, optional
        The last step that counts; by default all that have a motion.
    """
    steps = last_step(out) if last is None else min(last, last_step(out))
    own = [
        experiment.file(run.trajectory) if run.trajectory else out / "trajectory.parquet"
        for run in experiment.run
        if not run.step
    ]
    return [*dict.fromkeys(own), *(motion_of(out, step) for step in range(1, steps + 1))]


def step_diagnosed(verdict: Verdict) -> int:
    """Return the last step whose recordings a verdict was computed from."""
    return max((step_of(Path(one.name).stem) for one in verdict.provenance.inputs), default=0)


def repeated_runs(experiment: Experiment, imported: ImportedRuns) -> list[RunSettings]:
    """Return the runs that each step repeats: no command records an imported one."""
    return [run for run in experiment.run if not run.step and run.name not in imported.names]


def with_investigation(experiment: Experiment, imported: ImportedRuns, out: Path) -> Experiment:
    """Return the experiment with the runs of its investigation.

    Parameters
    ----------
    experiment : Experiment
        With its own runs.
    imported : ImportedRuns
        Runs of which none is repeated.
    out : Path
        Folder of the results.
    """
    own = [run for run in experiment.run if run.name in imported.names or not run.step]
    repeated, steps = repeated_runs(experiment, imported), range(1, last_step(out) + 1)
    further = chain.from_iterable([run.repeated(step) for run in repeated] for step in steps)
    return experiment.model_copy(update={"run": (*own, *further)})


def refuse_lost_motion(experiment: Experiment, out: Path) -> None:
    """Refuse to leave out recordings because the motion that they followed is missing.

    Parameters
    ----------
    experiment : Experiment
        With the runs of its investigation.
    out : Path
        Folder of the results.

    Raises
    ------
    InputError
        Names the missing motion, and a file that depends on it.
    """
    names, last = {run.name for run in experiment.run}, last_step(out)
    recordings = sorted((out / "recordings").glob("*+*.parquet"))
    lost = [file for file in recordings if _step_of(file, names) > last]
    for motion in sorted((out / "investigation").glob("*/trajectory.parquet")):
        step = motion.parent.name
        if step.isdecimal() and int(step) > last:
            lost.append(motion)
    if lost:
        raise InputError(
            f"{motion_of(out, last + 1)}: no such file, so {lost[0]} would be left out of all"
            " results; put the motion back, or move what depends on it to another folder"
        )


def _step_of(recording: Path, names: set[str]) -> int:
    """Return the step that a run with one of some names was recorded in; 0 for other files."""
    step, base = step_of(recording.stem), recording.stem.partition("+")[0]
    return step if step and base in names and "imported" not in metadata_of(recording) else 0


def refuse_lost_verdicts(out: Path) -> None:
    """Refuse a step without a whole verdict, before anything is recorded.

    Raises
    ------
    InputError
        Names the first file that is missing or damaged.
    """
    for step, file in enumerate(verdicts_before_steps(out), 1):
        try:
            read(file)
        except (OSError, ContractError) as error:
            raise InputError(
                f"{file}: is missing or damaged; `exoid diagnose` makes it again, from the"
                f" recordings before step {step} and with -o to another folder"
            ) from error
