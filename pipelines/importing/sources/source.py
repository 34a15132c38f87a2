"""A log as named columns, whatever its format."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from numpy.typing import NDArray

Columns = dict[str, NDArray]


@dataclass(frozen=True)
class Source:
    """A log whose columns are read when they are asked for."""

    path: Path
    format: str
    names: tuple[str, ...]
    """Of its columns; what is nested has dotted names, what is an array has numbered ones."""
    load: Callable[[Sequence[str]], Columns]
    """Return the named columns, each (n,) as the file has them; a constant has one row."""
    notes: tuple[str, ...] = ()
    """How it was read, where that was found by looking at it."""

    def __str__(self) -> str:
        return str(self.path)
