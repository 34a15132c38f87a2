"""The experiment that a command is about: the exoid.toml that is named, else the one in the current
folder."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.settings import Experiment
    from pipelines.workflow.graph import Step

NAME = "exoid.toml"

ConfigOption = Annotated[
    Path | None,
    typer.Option("--config", help="The experiment's settings.", show_default="exoid.toml"),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", help="Folder of the results.", show_default="that of exoid.toml"),
]


def is_experiment() -> bool:
    """Return whether the current folder is an experiment's."""
    return Path(NAME).is_file()


def settings_in_force(config: Path | None) -> "Experiment":
    """Return the settings in the named file, else in ./exoid.toml, else the defaults."""
    from pipelines.settings import Experiment

    here = config or (Path(NAME) if is_experiment() else None)
    return Experiment.load(here) if here else Experiment()


@dataclass(frozen=True)
class Place:
    """An experiment with the place of its settings and its results."""

    experiment: "Experiment"
    steps: "tuple[Step, ...]"
    out: Path
    damaged: tuple[Path, ...] = ()
    """Imported recordings that cannot be read any more, for which there are no steps."""

    def of_stage(self, *stages: str) -> "list[Step]":
        """Return the steps of some stages."""
        return [step for step in self.steps if step.stage in stages]

    def step(self, stage: str, run: str | None = None) -> "Step":
        """Return the step of a stage, or its step for one run."""
        for step in self.of_stage(stage):
            if step.run == run:
                return step
        raise InputError(
            f"{self.out / NAME}: {why_absent(stage, run)}; say what to read and, with -o, what to"
            " write"
        )


def why_absent(stage: str, run: str | None = None) -> str:
    """Say why an experiment has no step of a stage, or none for a run."""
    if run:
        return f"the recording of run {run} was imported, and no command makes it"
    if stage in ("design", "acquire"):
        return (
            f"the recordings of all runs were imported, and `exoid {stage}` has nothing to do here"
        )
    if stage == "simulate":
        return "`exoid simulate` follows a leg's gait, and the recordings are of another machine"
    return f"no [[run]] has purpose validate, without which `exoid {stage}` has nothing to do here"


def place_of(
    config: Path | None, out: Path | None = None, lacking: str = "", *, look_only: bool = False
) -> Place:
    """Return the experiment to work in; where there is none, ``lacking`` begins what is said of it.

    One with a damaged recording is refused, unless it is only to be looked at.
    """
    from pipelines.settings import Experiment
    from pipelines.workflow.graph import graph
    from pipelines.workflow.imported import with_imported

    file = config or Path(NAME)
    if not config and not is_experiment():
        begin = f"{lacking}, and " if lacking else ""
        raise InputError(
            f"{begin}there is no {NAME} in {Path.cwd()}; {_how_to_begin(named=not lacking)}"
        )
    folder = out or file.parent
    experiment, imported = with_imported(Experiment.load(file), folder)
    if not look_only:
        imported.refuse_damaged()
    return Place(experiment, graph(experiment, file, folder, imported), folder, imported.damaged)


def _how_to_begin(named: bool) -> str:
    from pipelines.workflow.imported import imported_in

    if imported_in(Path("recordings")):
        return (
            f"with an empty {NAME} beside recordings/, `exoid run` does all with what was imported"
        )
    return (
        f"{'' if named else 'name it, '}go to an experiment's folder, name its settings with"
        " --config, or start one with `exoid init DIR`; beside recordings that `exoid import`"
        f" made, an empty {NAME} is enough"
    )


def inputs_and_folder(
    stage: str, files: list[Path] | None, output: Path | None, config: Path | None, lacking: str
) -> tuple[list[Path], Path]:
    """Return what a stage reads and the folder that it writes into; what is not given, as the
    experiment has it."""
    return (
        files or list(place_of(config, lacking=lacking).step(stage).inputs),
        output or place_of(config, lacking="-o: missing").step(stage).target.parent,
    )
