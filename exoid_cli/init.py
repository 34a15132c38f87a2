"""``exoid init``: a new experiment to edit and run."""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from exoid_cli.console import console


def init(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of the experiment; created if need be.")
    ],
) -> None:
    """Start a new experiment: a commented exoid.toml, rigs, and a Makefile.

    \b
    Example:
      exoid init my_experiment
      cd my_experiment
      exoid run
    """
    from pipelines.settings.template import create

    # The Makefile calls exoid by its path: make may have another PATH, without the environment.
    command = Path(sys.argv[0])
    words = [sys.executable, "-m", "exoid_cli"]
    if command.name == "exoid":
        words = [str(command.resolve())]
    create(folder, exoid=shlex.join(words))
    written = [folder / name for name in ("exoid.toml", "rigs", "Makefile")]
    console.emit({"folder": folder, "written": written})
    console.say(
        f"{folder}: a new experiment; edit {folder / 'exoid.toml'}, then `cd {folder}` and `exoid"
        " run`"
    )
