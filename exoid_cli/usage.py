"""A mistyped command line, told in one line: what was found, what was expected, what to do."""

import re
from typing import Any

from typer.exceptions import TyperException

from pipelines.validation.explain import expectation
from pipelines.validation.suggestion import closest


def told(error: TyperException) -> str:
    """Say in exoid's words what typer found wrong with a command line."""
    context: Any = getattr(error, "ctx", None)
    message, option = error.format_message().rstrip("."), getattr(error, "option_name", None)
    called = f"`{context.command_path} --help`" if context else "`exoid --help`"
    if option and message.startswith("No such option"):
        return _unknown(option, "option", context.command.get_params(context), called)
    if match := re.match(r"No such command '(.*?)'", message):
        return _unknown(
            match[1], "command", list(context.command.commands) if context else [], called
        )
    parameter = getattr(error, "param", None)
    if parameter is not None:
        about = _about(parameter, error.message)
        return f"{_name(parameter)}: {about}" + ("" if about.endswith("?") else f"; see {called}")
    return f"{message[:1].lower()}{message[1:]}; see {called}"


def _unknown(word: str, kind: str, known: list[Any], called: str) -> str:
    names = [
        name for one in known for name in ([one] if isinstance(one, str) else one.opts) if name
    ]
    near = closest(word, names)
    return f"{word}: no such {kind}; " + (
        f"did you mean {near}?" if near else f"{called} lists those there are"
    )


def _name(parameter: Any) -> str:
    options = [name for name in parameter.opts if name.startswith("--")]
    return options[0] if options else parameter.display_name_raw


def _about(parameter: Any, message: str) -> str:
    """Say what is wrong with the value of an option or argument."""
    choices = parameter.type_descriptor.choices if parameter.type_descriptor.is_choice else None
    if not message.strip():
        return "missing" + (f", expected {' or '.join(map(str, choices))}" if choices else "")
    match = re.search(r"'(.*)' is not one of", message)
    if choices and match:
        near = closest(match[1], list(choices))
        return f"found {match[1]}, expected {', '.join(choices)}" + (
            f"; did you mean {near}?" if near else ""
        )
    return f"expected {expectation(message)}"
