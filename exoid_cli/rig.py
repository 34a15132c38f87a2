"""``exoid rig``: the commands for a rig file; a file without a command is served."""

from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from exoid_cli.console import console
from exoid_cli.global_options import Command, JsonOption, QuietOption, with_global_options
from exoid_cli.rig_check import check
from exoid_cli.rig_serve import serve
from pipelines.validation.suggestion import closest


class _RigGroup(TyperGroup):
    """A group in which ``exoid rig FILE`` means ``exoid rig serve FILE``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        words = [word for word in args if word not in ("--json", "--quiet", "-q")]
        # A word that is no file and near a command is a typing error, and gets a suggestion.
        mistyped = words and not Path(words[0]).exists() and closest(words[0], list(self.commands))
        if words and words[0] not in (*self.commands, "--help") and not mistyped:
            args = ["serve", *args]
        return super().parse_args(ctx, args)


rig = typer.Typer(cls=_RigGroup, rich_markup_mode=None)


@rig.callback()
def options(quiet: QuietOption = False, json: JsonOption = False) -> None:
    """Check a rig, or serve a virtual one. `exoid rig FILE` serves.

    \b
    Example:
      exoid rig serve rigs/real_time.toml --port 5020
    """
    console.add_options(quiet=quiet, json=json)


rig.command("serve", cls=Command, short_help="Serve a virtual rig over Modbus TCP.")(
    with_global_options(serve)
)
rig.command("check", cls=Command, short_help="Say whether a rig is what its file says.")(
    with_global_options(check)
)
