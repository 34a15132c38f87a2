"""A log as named columns, whatever its format."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from numpy.typing import NDArray

Columns = dict[str, NDArray]


@dataclass(frozen=True)
class Source:
    """A log whose columns are read on demand."""

    path: Path
    format: str
    names: tuple[str, ...]
    """Names of its columns: dotted where nested, numbered where part of an array."""
    load: Callable[[Sequence[str]], Columns]
    """Return the named columns, each (n,) as the file has them; a constant has one row."""
    notes: tuple[str, ...] = ()
    """How it was read, as far as that was derived from its content."""

    @classmethod
    def in_memory(
        cls, path: Path, format: str, columns: Columns, notes: tuple[str, ...] = ()
    ) -> "Source":
        """Return a log whose columns, each (n,), have been read already."""
        return cls(
            path, format, tuple(columns), lambda names: {n: columns[n] for n in names}, notes
        )

    def __str__(self) -> str:
        return str(self.path)
