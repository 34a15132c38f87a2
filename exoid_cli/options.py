"""Options and arguments that several commands share."""

from pathlib import Path
from typing import Annotated, Any

import typer

AgainOption = Annotated[bool, typer.Option("--again", help="Redo even if up to date.")]
YesOption = Annotated[bool, typer.Option("--yes", help="Do not ask before a real rig is moved.")]
ConfigOption = Annotated[
    Path | None, typer.Option(help="The experiment's settings.", show_default="exoid.toml")
]
OutOption = Annotated[
    Path | None, typer.Option(help="Folder of the results.", show_default="that of exoid.toml")
]


def files_argument(help: str, default: str) -> Any:
    """Return the argument of a command's input files, by default the experiment's."""
    return typer.Argument(metavar="FILE", help=help, show_default=default)


def output_option(help: str, default: str, *more_names: str) -> Any:
    """Return the option of a command's output, by default the experiment's."""
    return typer.Option("-o", "--output", *more_names, help=help, show_default=default)
