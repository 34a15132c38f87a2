"""``exoid rig``: what can be done with a rig file; with a file and no verb, it is served."""

from typing import Any

import typer
from typer.core import TyperGroup

from exoid_cli.rig import rig as serve
from exoid_cli.rig_check import check


class _ServesAFile(TyperGroup):
    """``exoid rig FILE`` means ``exoid rig serve FILE``: it did before there was anything else to do with one."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, "--help"):
            args = ["serve", *args]
        return super().parse_args(ctx, args)


rig = typer.Typer(
    cls=_ServesAFile,
    help="Check a rig, or serve a virtual one. `exoid rig FILE` serves.\n\n"
    "\b\nExample:\n  exoid rig serve rigs/real_time.toml --port 5020",
    rich_markup_mode=None,
)
rig.command("serve", short_help="Serve a virtual rig over Modbus TCP.")(serve)
rig.command("check", short_help="Say whether a rig is what its file says.")(check)
