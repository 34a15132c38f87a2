"""``--json`` and ``--quiet``, which every command takes before its name and after it."""

import inspect
from collections.abc import Callable
from functools import partial, wraps
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from exoid_cli.console import console

QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors and warnings only.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]


def with_global_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--json`` and ``--quiet`` to the options of a command's function."""

    @wraps(function)
    def command(*, quiet: bool, json: bool, **values: Any) -> Any:
        console.add_options(quiet=quiet, json=json)
        return function(**values)

    # Keyword-only, so that parameters without a default may follow those with one.
    parameters = [
        parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for parameter in inspect.signature(function, eval_str=True).parameters.values()
    ]
    # After the command's own options, which a reader of `--help` looks for first.
    parameters += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=option)
        for name, option in (("quiet", QuietOption), ("json", JsonOption))
    ]
    # Typer reads the options from the signature; type checkers do not know the attribute.
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return command


class Command(TyperCommand):
    """A command whose help names types as paths, names and numbers."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        for parameter in self.params:
            # Typer's parameters have it; the click base that they are declared as has not.
            parameter.display_type = partial(_plain_type, parameter.display_type)  # type: ignore[attr-defined]


def _plain_type(display_type: Callable[[Any], str], ctx: Any) -> str:
    name = display_type(ctx).strip("<>")
    # Names of Python's types in help texts.
    names = {
        "list[Path]": "path",
        "str": "name",
        "list[str]": "name",
        "float range": "number",
        "int range": "number",
        "int": "number",
    }
    return f"<{names.get(name, name)}>"
