"""The experiment that a command works on: ``--config``, else the exoid.toml in this folder."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.settings import Experiment
    from pipelines.workflow.graph import Step
    from pipelines.workflow.imported import ImportedRuns

NAME = "exoid.toml"


@dataclass(frozen=True)
class ExperimentFolder:
    """An experiment's settings, its steps, and the folder of its results."""

    experiment: "Experiment"
    steps: "tuple[Step, ...]"
    out: Path
    imported: "ImportedRuns"

    def of_stage(self, *stages: str) -> "list[Step]":
        """Return the steps of some stages."""
        return [step for step in self.steps if step.stage in stages]

    def step(self, stage: str, run: str | None = None) -> "Step":
        """Return the step of a stage, or its step for one run."""
        for step in self.of_stage(stage):
            if step.run == run:
                return step
        if run and run not in self.imported.names:
            raise InputError(
                f"run {run}: there is no motion for it in {self.out / 'investigation'}; `exoid"
                " investigate` adds steps, each with a motion"
            )
        raise InputError(
            f"{self.experiment.path}: {why_no_step(stage, run)}; name the files to read and, with"
            " -o, what to write"
        )


def in_experiment_folder() -> bool:
    """Return whether the current folder holds an exoid.toml."""
    return Path(NAME).is_file()


def settings_in_force(config: Path | None) -> "Experiment":
    """Return the settings in the named file, else in ./exoid.toml, else the defaults."""
    from pipelines.settings import Experiment

    file = config or (Path(NAME) if in_experiment_folder() else None)
    return Experiment.load(file) if file else Experiment()


def open_experiment(
    config: Path | None, out: Path | None = None, problem: str = "", *, allow_damaged: bool = False
) -> ExperimentFolder:
    """Return the experiment to work on.

    Without one, the error begins with ``problem``. Unless ``allow_damaged``, an experiment with a
    damaged recording, or without the motion of one, is refused.
    """
    from pipelines.settings import Experiment
    from pipelines.workflow.graph import graph
    from pipelines.workflow.imported import with_imported
    from pipelines.workflow.investigation import refuse_lost_motion, with_investigation

    file = config or Path(NAME)
    if not config and not in_experiment_folder():
        begin = f"{problem}, and " if problem else ""
        raise InputError(
            f"{begin}there is no {NAME} in {Path.cwd()}; {_how_to_begin(named=not problem)}"
        )
    # Results lie next to exoid.toml, wherever the command is called.
    folder = out or file.parent
    # Imported recordings count as runs, although exoid.toml has no [[run]] for them.
    experiment, imported = with_imported(Experiment.load(file), folder)
    experiment = with_investigation(experiment, imported, folder)
    if not allow_damaged:
        imported.refuse_damaged()
        refuse_lost_motion(experiment, folder)
    steps = graph(experiment, file, folder, imported)
    return ExperimentFolder(experiment, steps, folder, imported)


def inputs_and_folder(
    stage: str, files: list[Path] | None, output: Path | None, config: Path | None, problem: str
) -> tuple[list[Path], Path]:
    """Return a stage's inputs and output folder, from the experiment unless they are given."""
    return (
        # Opened only where something is missing: outside an experiment all may be given.
        files or list(open_experiment(config, problem=problem).step(stage).inputs),
        output or open_experiment(config, problem="-o: missing").step(stage).target.parent,
    )


def why_no_step(stage: str, run: str | None = None) -> str:
    """Say why an experiment has no step of a stage, or none for a run."""
    if run:
        return f"the recording of run {run} was imported, and no command makes it"
    if stage in ("design", "acquire"):
        return (
            f"the recordings of all runs were imported, and `exoid {stage}` has nothing to do here"
        )
    if stage == "simulate":
        return "`exoid simulate` follows a leg's gait, and the recordings are of another machine"
    what = "`exoid diagnose`" if stage == "diagnose" else f"stage {stage}"
    return f"no [[run]] has purpose validate, without which {what} has nothing to do here"


def _how_to_begin(named: bool) -> str:
    from pipelines.workflow.imported import imported_in

    if imported_in(Path("recordings")):
        return f"put an empty {NAME} next to recordings/, then `exoid run` uses what was imported"
    return (
        f"{'' if named else 'name the missing file, '}go to an experiment's folder, name its"
        " settings with --config, or start one with `exoid init DIR`; next to imported recordings/"
        f" an empty {NAME} is enough"
    )
