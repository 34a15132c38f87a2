"""The causes of a verdict, and labels in sentences, in words; unknown effects by their names."""

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from pipelines.contracts.joints import the
from pipelines.errors import InputError
from pipelines.wording.label import effect_of_cause, in_words, label_in_words
from pipelines.wording.law import LAW

if TYPE_CHECKING:
    from pipelines.contracts.verdict import Cause, Tie


def any_label_in_words(label: str) -> str:
    """Return a label such as ``cogging@knee`` in words; an unknown effect by its name."""
    name, _, joint = label.partition("@")
    at = f" at {the(joint)}" if joint else ""
    try:
        return label_in_words(label)
    except (InputError, KeyError):
        return name.removeprefix(LAW).replace("_", " ") + at


def cause_in_words(cause: "Cause | Tie") -> str:
    """Return a verdict's cause in words, with a note if it differs from run to run."""
    try:
        return in_words(effect_of_cause(cause))
    except InputError:
        return any_label_in_words(cause.label)


def shares_in_words(causes: Iterable["Cause"]) -> dict[str, str]:
    """Return a verdict's causes and their ties in words, by label."""
    # The per-run variant of a cause may be its tie, and has its label: the cause comes last.
    return {one.label: cause_in_words(one) for cause in causes for one in reversed(cause.with_ties)}


def labels_in_words(text: str, labels: Iterable[str]) -> str:
    """Return a sentence with its labels replaced by words."""
    # Longest first, because one label may be the beginning of another.
    known = sorted(set(labels), key=len, reverse=True)
    if not known:
        return text
    # Not inside a longer word: a joint may be called knee2.
    pattern = rf"(?<![\w@])(?:{'|'.join(map(re.escape, known))})(?![\w@])"
    return re.sub(pattern, lambda match: any_label_in_words(match[0]), text)


def causes_in_words(causes: Sequence["Cause"]) -> str:
    """Return a verdict's causes in words, most probable first, each with its ties."""
    words = [_tied_in_words(cause) for cause in causes]
    tied = any(cause.indistinguishable_from for cause in causes)
    return (", and " if tied else " and ").join(words)


def _tied_in_words(cause: "Cause") -> str:
    """Return a cause in words, with its only tie, or with the number of its ties."""
    words, ties = cause_in_words(cause), cause.indistinguishable_from
    if not ties:
        return words
    if len(ties) > 1:
        return f"{words} or {len(ties)} others that these data cannot separate"
    # The joint is named once if both causes are at it.
    other, where = cause_in_words(ties[0]), f" at {the(cause.joint or '')}"
    return f"{words.removesuffix(where) if other.endswith(where) else words} or {other}"
