"""Suggest a known name for an unknown one."""

import difflib
from collections.abc import Sequence
from functools import partial
from pathlib import Path


def suggestion(word: str, known: list[str]) -> str:
    """Return ``did you mean ...?`` or, without a similar name, the list of known names."""
    near = closest(word, known)
    return f"did you mean {near}?" if near else f"known are {', '.join(known)}"


def closest(word: str, known: Sequence[str]) -> str | None:
    """Return the known name most similar to a mistyped or shortened word, if any is similar."""
    # The likeness above which difflib suggests a name, too.
    similar = (name for name in known if _likeness(word, name) > 0.6)
    return max(similar, key=partial(_likeness, word), default=None)


def similar_file(path: Path) -> str:
    """Return ``did you mean ...?`` with an existing file of a similar name; else an empty text.

    For a symbolic link to a missing file return that fact.
    """
    if path.is_symlink():
        return f"it is a symbolic link to {path.readlink()}, which is missing; correct the link"
    names = [file.name for file in path.parent.iterdir()] if path.parent.is_dir() else []
    # Names of runs of one kind are similar, but not mistyped.
    near = difflib.get_close_matches(path.name, names, 1, cutoff=0.85)
    return f"did you mean {path.parent / near[0]}?" if near else ""


def _likeness(word: str, name: str) -> float:
    """Return the likeness of two words, 0 to 1; the beginning or a part of a name counts, too."""

    def ratio(part: str) -> float:
        return difflib.SequenceMatcher(None, word.lower(), part.lower()).ratio()

    # A part counts less than a whole name. Parts of one or two letters match by chance.
    parts = [name[: len(word)], *name.split("_")]
    return max([ratio(name), *(0.8 * ratio(part) for part in parts if len(part) > 2)])
