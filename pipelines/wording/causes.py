"""The causes of a verdict, and labels in sentences, in words; unknown effects by their names."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pipelines.contracts.joints import the
from pipelines.errors import InputError
from pipelines.wording.label import cause_label, effect_of_cause, in_words, label_in_words
from pipelines.wording.law import LAW


def any_label_in_words(label: str) -> str:
    """Return a label such as ``cogging@knee`` in words; an unknown effect by its name."""
    name, _, joint = label.partition("@")
    at = f" at {the(joint)}" if joint else ""
    try:
        return label_in_words(label)
    except (InputError, KeyError):
        return name.removeprefix(LAW).replace("_", " ") + at


def cause_in_words(cause: Mapping[str, Any]) -> str:
    """Return a verdict's cause in words, with a note if it differs from run to run."""
    try:
        return in_words(effect_of_cause(cause))
    except InputError:
        return any_label_in_words(cause_label(cause))


def shares_in_words(verdict: Mapping[str, Any]) -> dict[str, str]:
    """Return a verdict's causes and their ties in words, by label."""
    return {
        cause_label(one): cause_in_words(one)
        for cause in verdict["causes"]
        for one in (*ties_of(cause), cause)
    }


def labels_in_words(text: str, labels: Iterable[str]) -> str:
    """Return a sentence with its labels replaced by words."""
    known = sorted(set(labels), key=len, reverse=True)
    if not known:
        return text
    pattern = rf"(?<![\w@])(?:{'|'.join(map(re.escape, known))})(?![\w@])"
    return re.sub(pattern, lambda match: any_label_in_words(match[0]), text)


def causes_in_words(causes: Sequence[dict[str, Any]]) -> str:
    """Return a verdict's causes in words, most probable first, each with its ties."""
    words = [_tied_in_words(cause) for cause in causes]
    return (", and " if any(map(ties_of, causes)) else " and ").join(words)


def _tied_in_words(cause: dict[str, Any]) -> str:
    """Return a cause in words, with its only tie, or with the number of its ties."""
    words, ties = cause_in_words(cause), ties_of(cause)
    if not ties:
        return words
    if len(ties) > 1:
        return f"{words} or {len(ties)} others that these data cannot separate"
    other, where = cause_in_words(ties[0]), f" at {the(cause['joint'])}"
    return f"{words.removesuffix(where) if other.endswith(where) else words} or {other}"


def ties_of(cause: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the causes that these data cannot separate from a named one."""
    return list(cause["indistinguishable_from"])
