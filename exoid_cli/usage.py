"""The error of a mistyped command line, in one line."""

import re
from typing import Any

from typer.exceptions import TyperException

from pipelines.validation.explain import expectation
from pipelines.validation.suggestion import closest


def message(error: TyperException) -> str:
    """Return the message of a mistyped command line, with the command for its help."""
    context: Any = getattr(error, "ctx", None)
    text, option = error.format_message().rstrip("."), getattr(error, "option_name", None)
    help_command = f"`{context.command_path} --help`" if context else "`exoid --help`"
    # Errors of an option's value name an option, too, so the text decides.
    if option and text.startswith("No such option"):
        return _unknown(option, "option", context.command.get_params(context), help_command)
    no_command = re.match(r"No such command '(.*?)'", text)
    if no_command:
        commands = list(context.command.commands) if context else []
        return _unknown(no_command[1], "command", commands, help_command)
    # click's own words vary; a fault of a value is worded as in settings files.
    parameter = getattr(error, "param", None)
    if parameter is not None:
        fault = _value_fault(parameter, error.message)
        remedy = "" if fault.endswith("?") else f"; see {help_command}"
        return f"{_name(parameter)}: {fault}{remedy}"
    return f"{text[:1].lower()}{text[1:]}; see {help_command}"


def _unknown(word: str, kind: str, known: list[Any], help_command: str) -> str:
    names = [
        name for one in known for name in ([one] if isinstance(one, str) else one.opts) if name
    ]
    near = closest(word, names)
    remedy = f"did you mean {near}?" if near else f"{help_command} lists those there are"
    return f"{word}: no such {kind}; {remedy}"


def _name(parameter: Any) -> str:
    options = [name for name in parameter.opts if name.startswith("--")]
    return options[0] if options else parameter.display_name_raw


def _value_fault(parameter: Any, text: str) -> str:
    """Return what is wrong with an option's or argument's value."""
    choices = parameter.type_descriptor.choices if parameter.type_descriptor.is_choice else None
    if not text.strip():
        return "missing" + (f", expected {' or '.join(map(str, choices))}" if choices else "")
    match = re.search(r"'(.*)' is not one of", text)
    if choices and match:
        near = closest(match[1], list(choices))
        remedy = f"; did you mean {near}?" if near else ""
        return f"found {match[1]}, expected {', '.join(choices)}{remedy}"
    return f"expected {expectation(text)}"
