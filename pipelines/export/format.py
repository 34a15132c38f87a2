"""A file format: which terms of a model it can hold, and how it writes the model."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Generic, TypeVar

from pipelines.model import Term

Source = TypeVar("Source")
"""Type of the model that a format writes."""


class Degree(StrEnum):
    """How well a format holds a term."""

    EXACT = "exactly"
    APPROXIMATE = "approximately"
    NOT = "left out"


@dataclass(frozen=True)
class Holding:
    """How a format holds a term."""

    degree: Degree
    how: str
    """Its place in the file, or why it is left out."""


def exact(how: str) -> Holding:
    """Return the holding of a term that is written exactly."""
    return Holding(Degree.EXACT, how)


def approximate(how: str) -> Holding:
    """Return the holding of a term that is written approximately."""
    return Holding(Degree.APPROXIMATE, how)


def left_out(why: str) -> Holding:
    """Return the holding of a term that is not written."""
    return Holding(Degree.NOT, why)


@dataclass(frozen=True)
class Format(Generic[Source]):
    """A file format of other tools."""

    name: str
    """Value of ``--to``."""
    title: str
    suffix: str
    """File suffix with its dot."""
    holds: Callable[[Term], Holding]
    """Returns the holding of a term, which may depend on its values, such as negative friction."""
    write: Callable[[Source, str], Mapping[str, str]]
    """Returns the text of each file by suffix, from a model and the file's stem."""

    def holding(self, term: Term) -> Holding:
        """Return how the format holds a term, with a note on values that differ between runs."""
        holding = self.holds(term)
        # A file holds one value; such a parameter has another one in every run.
        per_run = [p.name for p in term.effect.parameters if p.per_run]
        if holding.degree is Degree.NOT or not per_run:
            return holding
        note = f"{' and '.join(per_run)} of one run, each has its own"
        return replace(holding, how=f"{holding.how}; {note}")
