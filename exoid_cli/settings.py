"""``exoid settings``: check an experiment's settings, or write them for make."""

from pathlib import Path
from typing import Annotated

import typer

from exoid_cli.console import console
from exoid_cli.experiment_folder import open_experiment
from exoid_cli.global_options import Command, JsonOption, QuietOption, with_global_options

settings = typer.Typer(rich_markup_mode=None)


@settings.callback()
def options(quiet: QuietOption = False, json: JsonOption = False) -> None:
    """Work with an experiment's settings.

    \b
    Example:
      exoid settings check exoid.toml
    """
    console.add_options(quiet=quiet, json=json)


@settings.command("check", cls=Command, short_help="Say whether an experiment's file can be used.")
@with_global_options
def check(
    config: Annotated[
        Path, typer.Argument(metavar="FILE", help="The experiment's settings.")
    ] = Path("exoid.toml"),
) -> None:
    """Say whether an experiment's file can be used; print it complete with --json.

    \b
    Examples:
      exoid settings check
      exoid settings check my_experiment/exoid.toml --json
    """
    folder = open_experiment(config, allow_damaged=True)
    # Imported recordings need no rig.
    if folder.of_stage("acquire"):
        folder.experiment.refuse_what_cannot_run()
    console.emit(folder.experiment.model_dump(mode="json"))
    count = len(folder.experiment.run)
    console.say(f"{config}: {count} run{'s' * (count != 1)}, all settings are valid")


@settings.command("split", cls=Command, short_help="Write one file a section, for make.")
@with_global_options
def split(
    config: Annotated[Path, typer.Argument(metavar="FILE", help="The experiment's exoid.toml.")],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder for one file a section, written if changed.")
    ],
) -> None:
    """Write one file a section and the graph's rules, so that make re-runs what changed.

    \b
    Example:
      exoid settings split exoid.toml --out .settings
    """
    from pipelines.settings import Experiment
    from pipelines.workflow.split import split as split_settings

    # A file a section lets make compare times: a changed section makes only its own stages stale.
    split_settings(Experiment.load(config), out)
    console.emit({"folder": out, "written": sorted(path.name for path in out.iterdir())})
    console.say(f"{out}: one file a section, and graph.mk")
