"""Which column of a regression over several runs is which parameter, and which runs have it.

The regressor of one run has a column for each linear parameter of each term. In a fit of several
runs a parameter that differs from run to run has a column for each run that has its term; any other
has one column, which the runs share. Nothing else counts columns.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.effects import Effect, Parameter
from pipelines.effects.rigid_body import RigidBody
from pipelines.model.baseline import BASELINE


@dataclass(frozen=True)
class TermColumns:
    """The columns of one term: first those that runs share, then each run's own."""

    effect: Effect
    per_run: tuple[bool, ...]
    """(k,) which of the columns that the term has in a run are that run's own."""
    runs: tuple[int, ...]
    """Numbers of the runs that have the term."""
    start: int = 0
    """Its first column among all."""

    @classmethod
    def of(
        cls,
        effect: Effect,
        kinds: Sequence[str],
        per_run: Iterable[bool] | None = None,
        start: int = 0,
    ) -> "TermColumns":
        """Return the columns of an effect in runs of some kinds.

        They are those of its linear parameters, unless ``per_run`` tells of others.
        """
        if per_run is None:
            per_run = (parameter.per_run for parameter in effect.linear)
        acting = (run for run, kind in enumerate(kinds) if effect.acts(kind))
        return cls(effect, tuple(per_run), tuple(acting), start)

    @cached_property
    def columns(self) -> tuple[tuple[int, int | None], ...]:
        """Which of the k a column is, and of which run; None where runs share it."""
        shared = [(k, None) for k, own in enumerate(self.per_run) if not own]
        own = [(k, run) for run in self.runs for k, own in enumerate(self.per_run) if own]
        return (*shared, *own)

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.columns)

    @property
    def slice(self) -> slice:
        """Its columns among all."""
        return slice(self.start, self.start + self.width)

    def places(self, run: int | None) -> NDArray:
        """Return the column of each of the k in a run, (k,), -1 where no column tells of it.

        ``run`` is None for a run that was not fitted: of that only shared columns tell.
        """
        at = {column: self.start + i for i, column in enumerate(self.columns)}
        # No column is of run -1.
        runs = ((-1 if run is None else run) if own else None for own in self.per_run)
        return np.array([at.get(column, -1) for column in enumerate(runs)], dtype=int)

    def select(self, values: NDArray, run: int | None, otherwise: NDArray) -> NDArray:
        """Return the k values in a run, (k,), from those of all columns.

        ``otherwise``, (k,), is taken where no column tells of one.
        """
        places = self.places(run)
        return np.where(places < 0, otherwise, values[places])

    def expand(self, columns: NDArray, run: int) -> NDArray:
        """Put the term's columns in one run, (m, O, k), where they belong, (m, O, width)."""
        places = self.places(run)
        return _spread(columns, np.where(places < 0, -1, places - self.start), self.width)


class Column(NamedTuple):
    """One column of a layout."""

    effect: Effect
    parameter: Parameter
    run: int | None
    """Number of the run whose own it is; None where runs share it."""

    @property
    def name(self) -> str:
        """What messages call it."""
        effect, name = self.effect, self.parameter.name
        if isinstance(effect, RigidBody):
            return f"the person's {name}" if effect.run == "with_human" else name
        return f"{effect.joint} {name}" if effect.name in BASELINE else f"{name} of {effect.label}"


@dataclass(frozen=True)
class ParameterLayout:
    """The columns of several terms in a fit of several runs."""

    terms: tuple[TermColumns, ...]
    kinds: tuple[str, ...] = ()
    """The kind of each run."""

    @classmethod
    def of(
        cls,
        effects: Iterable[Effect],
        kinds: Sequence[str] = (),
        absent: Collection[tuple[int, int]] = (),
    ) -> "ParameterLayout":
        """Lay out the linear parameters of some effects.

        Parameters
        ----------
        effects : iterable of Effect
            In the order of the terms.
        kinds : sequence of str
            The kind of each run that is fitted.
        absent : collection of (int, int)
            Numbers of a term and of a run that lacks it although its kind could have it.
        """
        terms: list[TermColumns] = []
        start = 0
        for number, effect in enumerate(effects):
            one = TermColumns.of(effect, kinds, start=start)
            runs = tuple(run for run in one.runs if (number, run) not in absent)
            terms.append(replace(one, runs=runs))
            start += terms[-1].width
        return cls(tuple(terms), tuple(kinds))

    @cached_property
    def size(self) -> int:
        """Number of columns, p."""
        return sum(term.width for term in self.terms)

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The p columns."""
        columns = ((term.effect, *column) for term in self.terms for column in term.columns)
        return tuple(Column(effect, effect.linear[k], run) for effect, k, run in columns)

    @property
    def per_run(self) -> NDArray:
        """(q,) which of the columns of one run's regressor are its own."""
        return np.array([own for term in self.terms for own in term.per_run], dtype=bool)

    @property
    def bodies(self) -> NDArray:
        """Columns of each rigid body, (bodies, parameters), the machine's first."""
        return np.array([t.places(None) for t in self.terms if isinstance(t.effect, RigidBody)])

    def bodies_in(self, kind: str) -> NDArray:
        """Return the columns of each body that moves in a kind of run, (bodies, parameters)."""
        return self.bodies if kind == "with_human" else self.bodies[:1]

    def column_of(self, effect: str, joint: str | None, parameter: str) -> int:
        """Return the first column of a parameter, by its name and its effect's."""
        names = [(c.effect.name, c.effect.joint, c.parameter.name) for c in self.columns]
        return names.index((effect, joint, parameter))

    def acting_in(self, kind: str) -> NDArray:
        """Tell which columns act in a kind of run, (p,) bool."""
        acts = (
            column.effect.acts(kind) if column.run is None else self.kinds[column.run] == kind
            for column in self.columns
        )
        return np.array(list(acts), dtype=bool)

    def shapes(self, term: int) -> slice:
        """Return the places of a term's shapes, where all terms' shapes follow the p columns."""
        counts = [len(one.effect.shape) for one in self.terms]
        start = self.size + sum(counts[:term])
        return slice(start, start + counts[term])

    def select(self, values: NDArray, run: int | None) -> NDArray:
        """Return the values of one run's regressor, (q,), zero where no column tells of one."""
        parts = [term.select(values, run, np.zeros(len(term.per_run))) for term in self.terms]
        return np.concatenate(parts)

    def expand(
        self,
        columns: NDArray,
        run: int | None,
        terms: Iterable[int] | None = None,
    ) -> NDArray:
        """Put the columns of one run's regressor, (m, O, q), where they belong, (m, O, p).

        ``terms`` are the numbers of the terms that the regressor has, all unless given; ``run`` is
        None for a run that was not fitted.
        """
        chosen = self.terms if terms is None else [self.terms[term] for term in terms]
        places = np.concatenate([term.places(run) for term in chosen])
        return _spread(columns, places, self.size)


def _spread(columns: NDArray, places: NDArray, width: int) -> NDArray:
    """Put columns, (m, O, k), in places, (k,), among others that are zero, (m, O, width).

    Those whose place is -1 are left out.
    """
    if np.array_equal(places, np.arange(width)):
        return columns
    there = places >= 0
    wide = np.zeros((*columns.shape[:-1], width))
    wide[..., places[there]] = columns[..., there]
    return wide
