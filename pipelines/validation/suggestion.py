"""What somebody may have meant who wrote a name that is not known."""

import difflib
from collections.abc import Sequence
from functools import partial
from pathlib import Path


def suggestion(word: str, known: list[str]) -> str:
    """Return ``did you mean ...?`` or, with nothing close, the list of what is known."""
    near = closest(word, known)
    return f"did you mean {near}?" if near else f"known are {', '.join(known)}"


def closest(word: str, known: Sequence[str]) -> str | None:
    """Return what a mistyped or shortened word was most likely meant to be, or None if nothing is
    near enough."""
    return max(
        (name for name in known if _likeness(word, name) > LIKE),
        key=partial(_likeness, word),
        default=None,
    )


def similar_file(path: Path) -> str:
    """Return ``did you mean ...?`` where a file of nearly that name stands in the place of one that
    does not exist.

    Of a symbolic link that points to nothing it says that.
    """
    if path.is_symlink():
        return f"it is a symbolic link to {path.readlink()}, which is not there; link it anew"
    names = [file.name for file in path.parent.iterdir()] if path.parent.is_dir() else []
    # Runs of one kind are no slips of each other.
    near = difflib.get_close_matches(path.name, names, 1, cutoff=0.85)
    return f"did you mean {path.parent / near[0]}?" if near else ""


LIKE = 0.6
"""Likeness from which on a name is suggested, as in difflib."""


def _likeness(word: str, name: str) -> float:
    """Return how like two words are, 0 to 1; the beginning of a name, or one of its words, is
    nearly as like."""

    def ratio(part: str) -> float:
        return difflib.SequenceMatcher(None, word.lower(), part.lower()).ratio()

    parts = [name[: len(word)], *name.split("_")]
    return max([ratio(name), *(0.8 * ratio(part) for part in parts if len(part) > 2)])
