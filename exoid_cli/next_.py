"""``exoid next``: the experiment that would end the doubt of a verdict."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli.console import console
from exoid_cli.excitation import planned_geometry, write_excitation
from exoid_cli.experiment_folder import NAME, settings_in_force
from exoid_cli.options import ConfigOption
from exoid_cli.separate import question_of

if TYPE_CHECKING:
    from pipelines.investigation.next_experiments import NextExperiments
    from pipelines.investigation.separating_design import SeparatingDesign
    from pipelines.settings import Experiment


def next_(
    folder: Annotated[
        Path | None,
        typer.Argument(
            metavar="DIR", help="What `exoid diagnose` wrote.", show_default="diagnosed"
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="File of the motion that separates the causes best."),
    ] = None,
    config: ConfigOption = None,
) -> None:
    """Say which experiment would decide between the causes that a verdict leaves open.

    \b
    Examples:
      exoid next
      exoid next diagnosed -o next.parquet
    """
    folder = folder or Path("diagnosed")
    own = folder.resolve().parent / NAME
    # The diagnosed recordings and their motions are of that experiment, wherever this is called.
    config = config or (own if own.is_file() else None)
    experiment = settings_in_force(config)
    if output:
        _refuse_place(output, folder, experiment)
    result = compare_experiments(folder, experiment, config)
    best = result.design
    if output and best:
        write_motion(output, best, experiment)
    elif output:
        console.warn(
            f"{output}: not written, as no motion within [design.bounds] separates the causes"
        )
    console.emit(
        {
            "open": [{"cause": one.label, "probability": one.probability} for one in result.rivals],
            "experiments": [vars(one) for one in result.experiments],
            "file": str(output) if output and result.design else None,
        }
    )
    show_experiments(result)
    if best:
        file = output or "-o FILE writes the motion"
        console.say(
            f"\n{file}: name it as the trajectory of a run in exoid.toml, and record it;"
            " `exoid investigate` does both."
        )


def _refuse_place(output: Path, folder: Path, experiment: "Experiment") -> None:
    """Refuse a file that cannot be written, or that recordings followed, before the search."""
    from pipelines.contracts import TRAJECTORY
    from pipelines.contracts.atomic import open_folder
    from pipelines.errors import InputError
    from pipelines.workflow.investigation import motions_of

    TRAJECTORY.refuse_place(output)
    followed = motions_of(experiment, folder.resolve().parent)
    if output.resolve() in [file.resolve() for file in followed]:
        raise InputError(
            f"{output}: is the motion that the diagnosed recordings followed, not overwritten; name"
            " another file"
        )
    if output.parent.exists():
        open_folder(output.parent)


def compare_experiments(
    folder: Path, experiment: "Experiment", config: Path | None
) -> "NextExperiments":
    """Return the experiments that could end the doubt of the verdict in a folder."""
    from pipelines.investigation.next_experiments import next_experiments

    experiment.mechanism.refuse_all_but_the_leg("`exoid next`")
    geometry = planned_geometry(experiment)
    question = question_of((), folder, experiment, experiment.design, config)
    with console.progress("designing", total=1.0) as report:
        return next_experiments(question.problem, geometry, question.last, report)


def write_motion(output: Path, design: "SeparatingDesign", experiment: "Experiment") -> None:
    """Write the excitation that separates rivals best."""
    geometry = planned_geometry(experiment)
    mechanism = experiment.sections("mechanism")
    write_excitation(output, design.design, design.metadata(), geometry, mechanism)


def show_experiments(result: "NextExperiments") -> None:
    """Show what is open, and what would decide it, the best first."""
    from pipelines.investigation.doubt import DECIDED
    from pipelines.wording.label import label_in_words

    named = [(label_in_words(one.label), one.probability) for one in result.rivals]
    causes = " or ".join(f"{words} ({probability:.2f})" for words, probability in named)
    console.say(f"Open: {causes}.\n")
    headings = ("experiment", f"decides ({DECIDED:.2f})", "how")
    rows = [(one.what, f"{one.decides:.0%}", one.words) for one in result.experiments]
    console.table(headings, rows, numbers=headings[1])
