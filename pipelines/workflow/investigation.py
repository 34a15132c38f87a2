"""The folder of an investigation: a folder for each step, with the motion that it adds.

``investigation/K`` holds what made step K: the verdict before it, and the motion that was designed
to end its doubt. Every [[run]] is repeated along the motion, as run ``NAME+K`` of the experiment.
"""

from itertools import chain, count, takewhile
from pathlib import Path

from pipelines.contracts.verdict import Verdict
from pipelines.settings.acquire import step_of
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


def motions_of(out: Path, last: int | None = None) -> list[Path]:
    """Return the motions of an experiment: the designed excitation, and that of each step.

    Parameters
    ----------
    out : Path
        Folder of the results.
    last : int, optional
        The last step that counts; by default all that have a motion.
    """
    steps = last_step(out) if last is None else min(last, last_step(out))
    return [out / "trajectory.parquet"] + [motion_of(out, step) for step in range(1, steps + 1)]


def step_diagnosed(verdict: Verdict) -> int:
    """Return the last step whose recordings a verdict was computed from."""
    return max((step_of(Path(one.name).stem) for one in verdict.provenance.inputs), default=0)


def with_investigation(experiment: Experiment, imported: ImportedRuns, out: Path) -> Experiment:
    """Return the experiment with the runs of its investigation.

    Parameters
    ----------
    experiment : Experiment
        With its own runs.
    imported : ImportedRuns
        No command records these, so none repeats them.
    out : Path
        Folder of the results.
    """
    own = [run for run in experiment.run if run.name in imported.names or not run.step]
    recorded = [run for run in own if run.name not in imported.names]
    steps = range(1, last_step(out) + 1)
    further = chain.from_iterable([run.repeated(step) for run in recorded] for step in steps)
    return experiment.model_copy(update={"run": (*own, *further)})
