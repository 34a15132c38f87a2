"""A log as named columns, whatever its format."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

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
    units: Mapping[str, str] = field(default_factory=dict)
    """Units that the file gives to columns outside of their names."""
    clocks: Mapping[str, str] = field(default_factory=dict)
    """Clocks of columns, where the file says which was sampled by which."""
    scaling: Mapping[str, str] = field(default_factory=dict)
    """Factors and offsets that the file gives to columns, but that may be in their values."""
    fields_above: tuple[str, ...] = ()
    """Fields above the rows that are no names of columns, because the map or numbers name them."""
    remarks: tuple[str, ...] = ()
    """What was not as it should be, for the user."""
    stated: tuple[str, ...] = ()
    """What the file says in words of how its values came about, and where."""
    aliases: Mapping[str, str] = field(default_factory=dict)
    """Other names that a map may use, and the columns that they mean."""

    @classmethod
    def in_memory(cls, path: Path, format: str, columns: Columns, **more: Any) -> "Source":
        """Return a log whose columns, each (n,), have been read already."""
        return cls(
            path, format, tuple(columns), lambda names: {n: columns[n] for n in names}, **more
        )

    def column_named(self, name: str) -> str:
        """Return the column that a map means by a name."""
        return name if name in self.names else self.aliases.get(name, name)

    def __str__(self) -> str:
        return str(self.path)


def numbered_twins(names: Sequence[str]) -> tuple[str, ...]:
    """Add numbers to names that occur twice: two columns ``q`` become ``q#1`` and ``q#2``."""
    times, seen = Counter(names), Counter[str]()
    apart = []
    for name in names:
        seen[name] += 1
        apart.append(name if times[name] == 1 else f"{name}#{seen[name]}")
    return tuple(apart)
