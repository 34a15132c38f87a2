"""What every command heeds, ``--json`` and ``--quiet``, before its name and after it."""

import inspect
from collections.abc import Callable
from functools import partial, wraps
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from exoid_cli.console import console

QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors and warnings only.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]


def heeding(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a command's function with ``--json`` and ``--quiet`` among its options."""

    @wraps(function)
    def command(*, quiet: bool, json: bool, **told: Any) -> Any:
        console.heed(quiet=quiet, json=json)
        return function(**told)

    own = inspect.signature(function, eval_str=True).parameters.values()
    # For the reader of `--help`: the command's own options first.
    ours = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=option)
        for name, option in (("quiet", QuietOption), ("json", JsonOption))
    ]
    kept = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in own]
    # What typer asks of a function and no type of Python's knows: its signature, told by itself.
    command.__signature__ = inspect.Signature([*kept, *ours])  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in (*kept, *ours)}
    return command


IN_WORDS = {
    "list[Path]": "path",
    "str": "name",
    "list[str]": "name",
    "float range": "number",
    "int range": "number",
    "int": "number",
}
"""What help calls the kinds of values that Python has other names for."""


class Command(TyperCommand):
    """A command whose help speaks of paths, names and numbers."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        for parameter in self.params:
            # Typer's parameters have it, the click base that they are declared as has not.
            parameter.display_type = partial(_in_words, parameter.display_type)  # type: ignore[attr-defined]


def _in_words(told: Callable[[Any], str], ctx: Any) -> str:
    kind = told(ctx).strip("<>")
    return f"<{IN_WORDS.get(kind, kind)}>"
