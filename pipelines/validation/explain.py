"""An error of pydantic in one line, with key, value and expectation."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from pipelines.validation.suggestion import suggestion

if TYPE_CHECKING:
    from pydantic import ValidationError


def explain(
    error: "ValidationError", data: Any, known_keys: Callable[[str], list[str]] = lambda path: []
) -> str:
    """Return which key is wrong, its value, and the expectation.

    Parameters
    ----------
    error : pydantic.ValidationError
        The error of a validation.
    data : dict
        The validated data, as read from TOML or JSON.
    known_keys : callable, optional
        Return the keys of the table at a dotted path ("" is the top), to suggest one.

    Returns
    -------
    str
        The first fault, and how many more there are.
    """
    faults: dict[str, list[dict[str, Any]]] = {}
    # A misspelt key comes first: the missing key it leaves behind is only its consequence.
    for fault in sorted(_own(error), key=lambda fault: fault["type"] != "extra_forbidden"):
        faults.setdefault(_key_path(fault, data), []).append(dict(fault))
    path, about = next(iter(faults.items()))
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return _sentence(path, about, known_keys) + more


def _own(error: "ValidationError") -> list[Any]:
    """Return the faults without consequences of others.

    A list is too short only because tables in it have a fault.
    """
    faults = error.errors(include_url=False)
    at = [fault["loc"] for fault in faults]
    return [
        fault
        for fault in faults
        if fault["type"] != "too_short"
        or not any(
            loc[: len(fault["loc"])] == fault["loc"] and len(loc) > len(fault["loc"]) for loc in at
        )
    ]


def _sentence(
    path: str, faults: list[dict[str, Any]], known_keys: Callable[[str], list[str]]
) -> str:
    kind = faults[0]["type"]
    if kind == "missing":
        return f"{path}: missing; add it"
    if kind == "extra_forbidden":
        parent, _, key = path.rpartition(".")
        known = known_keys(parent)
        return f"{path}: unknown key" + (f"; {suggestion(key, known)}" if known else "; remove it")
    if kind == "union_tag_not_found":
        return f"{path}.{_discriminator(faults[0])}: missing; add it"
    if kind == "union_tag_invalid":
        tag, known = faults[0]["ctx"]["tag"], faults[0]["ctx"]["expected_tags"]
        return f"{path}.{_discriminator(faults[0])}: found {tag!r}, expected one of {known}"
    if kind == "value_error":
        return f"{path}: {faults[0]['ctx']['error']}" if path else str(faults[0]["ctx"]["error"])
    # A union ("auto" or a number) has one fault for each of its members.
    expected = " or ".join(dict.fromkeys(expectation(fault["msg"]) for fault in faults))
    return f"{path}: found {_shortened(faults[0]['input'])}, expected {expected}"


def _discriminator(fault: dict[str, Any]) -> str:
    """Return the key that determines the kind of a table."""
    # pydantic quotes the key.
    return fault["ctx"]["discriminator"].strip("'")


def _key_path(fault: Any, data: Any) -> str:
    """Return the fault's dotted path in the file, without pydantic's names of union members."""
    path = ""
    for part in fault["loc"]:
        if isinstance(data, dict) and part in data:
            path, data = f"{path}.{part}" if path else str(part), data[part]
        elif isinstance(data, list | tuple) and isinstance(part, int):
            path, data = f"{path}[{part}]", data[part] if part < len(data) else None
        elif fault["type"] == "missing" and part == fault["loc"][-1]:
            path = f"{path}.{part}" if path else str(part)
    return path


def expectation(message: str) -> str:
    """Return pydantic's expectation, as the end of a sentence."""
    expected = message.removeprefix("Input should be ").split(", unable to")[0]
    return expected.replace("String should match pattern", "text matching")


def _shortened(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
