"""``exoid figures``: each figure of the report as PDF and PNG, for a paper."""

from pathlib import Path
from typing import Annotated

import typer

from exoid_cli import completion
from exoid_cli.console import console
from exoid_cli.report import FoldersArgument, warn_of_unreadable


def figures(
    folders: FoldersArgument = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the figures.")] = Path(
        "figures"
    ),
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Only this figure; repeatable.", autocompletion=completion.figures
        ),
    ] = None,
) -> None:
    """Draw the report's figures as PDF and PNG.

    \b
    Examples:
      exoid figures build/default -o figures/
      exoid figures diagnosed/ --only verdict --only error-budget
    """
    from pipelines.contracts.atomic import open_folder
    from pipelines.errors import InputError
    from pipelines.report.figure_files import draw
    from pipelines.report.figure_files import figures as figures_of
    from pipelines.report.session import find
    from pipelines.validation.suggestion import suggestion

    session = find(folders or [Path()])
    warn_of_unreadable(session)
    drawn = figures_of(session)
    if not drawn:
        raise InputError(
            f"{session.folders[0]}: holds nothing to draw; `exoid diagnose` and `exoid simulate`"
            " make it"
        )
    for name in only or ():
        if name not in drawn:
            raise InputError(
                f"--only {name}: there is no such figure here; {suggestion(name, list(drawn))}"
            )
    # A name given twice is drawn once.
    names = list(dict.fromkeys(only or drawn))
    open_folder(output)
    with console.progress("drawing", len(names)) as report:
        draw(drawn, names, output, report)
    console.emit({"folder": str(output), "figures": names})
    for name in names:
        console.say(f"{output / name}.pdf, .png")
