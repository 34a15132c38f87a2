"""What a format is: which terms of a model it can hold, and how the model is written in it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

from pipelines.model import Term

if TYPE_CHECKING:
    from pipelines.export.exported import Exported


class Degree(StrEnum):
    """How well a format holds a term."""

    EXACT = "exactly"
    APPROXIMATE = "approximately"
    NOT = "left out"


@dataclass(frozen=True)
class Holding:
    """What becomes of a term in a format."""

    degree: Degree
    how: str
    """Where in the file it is found, or why it is not there."""


def exact(how: str) -> Holding:
    """Return that a term is held exactly, and where."""
    return Holding(Degree.EXACT, how)


def approximate(how: str) -> Holding:
    """Return that a term is held approximately, where, and what is not exact."""
    return Holding(Degree.APPROXIMATE, how)


def left_out(why: str) -> Holding:
    """Return that a term is not held, and why."""
    return Holding(Degree.NOT, why)


@dataclass(frozen=True)
class Format:
    """A form that other tools read."""

    name: str
    """As ``--to`` takes it."""
    title: str
    suffix: str
    """Of the file, its dot included."""
    holds: Callable[[Term], Holding]
    """What becomes of a term, its values looked at: a negative friction, say, may be more than a
    format holds."""
    write: Callable[["Exported", str], Mapping[str, str]]
    """Of a model and the file's stem: the text of each file by its suffix."""

    def holding(self, term: Term) -> Holding:
        """Return what becomes of a term, and that each run has its own where what is held is one
        run's."""
        held, own = self.holds(term), [p.name for p in term.effect.parameters if p.per_run]
        if held.degree is Degree.NOT or not own:
            return held
        return replace(held, how=f"{held.how}; {' and '.join(own)} of one run, each has its own")
