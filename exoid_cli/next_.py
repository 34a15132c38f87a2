"""``exoid next``: the experiment that would end the doubt of a verdict."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli.console import console
from exoid_cli.excitation import last_excitation, write_excitation
from exoid_cli.experiment_folder import settings_in_force
from exoid_cli.options import ConfigOption
from exoid_cli.separate import question_of

if TYPE_CHECKING:
    from pipelines.investigation.next_experiments import NextExperiments


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
    from pipelines.investigation.next_experiments import next_experiments
    from pipelines.mechanics.geometry import Geometry
    from pipelines.mechanics.read import geometry_from

    folder = folder or Path("diagnosed")
    experiment = settings_in_force(config)
    experiment.mechanism.refuse_all_but_the_leg("`exoid next`")
    settings, geometry = experiment.design, geometry_from(experiment) or Geometry()
    rivals, runs = question_of((), folder, experiment, settings)
    _, last = last_excitation(config, settings, geometry)
    with console.progress("designing", total=1.0) as report:
        result = next_experiments(rivals, runs, geometry, last, report)
    best = result.design
    if output and best:
        mechanism = experiment.sections("mechanism")
        write_excitation(output, best.design, best.metadata(), geometry, mechanism)
    elif output:
        console.warn(
            f"{output}: not written, as no motion within [design.bounds] separates two causes"
        )
    console.emit(
        {
            "open": [{"cause": one.label, "probability": one.probability} for one in rivals],
            "experiments": [vars(one) for one in result.experiments],
            "file": str(output) if output and result.design else None,
        }
    )
    _show(result, output)


def _show(result: "NextExperiments", output: Path | None) -> None:
    from pipelines.investigation.separation import DECIDED
    from pipelines.wording.label import in_words

    causes = " or ".join(f"{in_words(one.effect)} ({one.probability:.2f})" for one in result.rivals)
    console.say(f"Open: {causes}.\n")
    headings = ("experiment", f"decides ({DECIDED:.2f})", "how")
    rows = [(one.what, f"{one.decides:.0%}", one.words) for one in result.experiments]
    console.table(headings, rows, numbers=headings[1])
    if result.design:
        file = output or "-o FILE writes the motion"
        console.say(f"\n{file}: name it as the trajectory of a run in exoid.toml, and record it.")
