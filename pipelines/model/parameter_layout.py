"""Assign the columns of a regression over several runs to parameters and runs.

The regressor of one run has a column for each linear parameter of each term. In a fit of several
runs, a parameter that differs from run to run has a column for each run that has its term. Any
other parameter has one column, which the runs share.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.effects import Effect, Parameter
from pipelines.effects.baseline import RigidBody
from pipelines.model.baseline import BASELINE


@dataclass(frozen=True)
class TermColumns:
    """The columns of one term: first those that runs share, then each run's own."""

    effect: Effect
    per_run: tuple[bool, ...]
    """(k,) whether each column of the term belongs to one run alone."""
    runs: tuple[int, ...]
    """Numbers of the runs that have the term."""
    start: int = 0
    """Number of its first column in the layout."""

    @classmethod
    def of(
        cls,
        effect: Effect,
        kinds: Sequence[str],
        per_run: Iterable[bool] | None = None,
        start: int = 0,
    ) -> "TermColumns":
        """Return the columns of an effect in runs of some kinds.

        Parameters
        ----------
        effect : Effect
            The term's effect.
        kinds : sequence of str
            Kind of each run, ``exo_alone`` or ``with_human``.
        per_run : iterable of bool, optional
            Whether each column differs from run to run; those of the linear parameters by default.
        start : int, optional
            Number of its first column in the layout.
        """
        if per_run is None:
            per_run = (parameter.per_run for parameter in effect.linear)
        acting = (run for run, kind in enumerate(kinds) if effect.acts(kind))
        return cls(effect, tuple(per_run), tuple(acting), start)

    @cached_property
    def columns(self) -> tuple[tuple[int, int | None], ...]:
        """Parameter number and run of each column; the run is None if all runs share the column."""
        # Each run appends its own columns, after those that all runs share.
        shared = [(k, None) for k, own in enumerate(self.per_run) if not own]
        own = [(k, run) for run in self.runs for k, own in enumerate(self.per_run) if own]
        return (*shared, *own)

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.columns)

    @property
    def slice(self) -> slice:
        """The term's columns in the layout."""
        return slice(self.start, self.start + self.width)

    def places(self, run: int | None) -> NDArray:
        """Return the columns of the k parameters in one run.

        Parameters
        ----------
        run : int or None
            Number of the run; None for a run that was not fitted, which has shared columns only.

        Returns
        -------
        (k,) int array
            Column numbers, -1 for a parameter without a column in that run.
        """
        at = {column: self.start + i for i, column in enumerate(self.columns)}
        # -1 is the number of no run.
        runs = ((-1 if run is None else run) if own else None for own in self.per_run)
        return np.array([at.get(column, -1) for column in enumerate(runs)], dtype=int)

    def select(self, values: NDArray, run: int | None, otherwise: NDArray) -> NDArray:
        """Select the values of one run.

        Parameters
        ----------
        values : (p,) array
            Values of all columns.
        run : int or None
            Number of the run; None for a run that was not fitted.
        otherwise : (k,) array
            Values of parameters that have no column in that run.

        Returns
        -------
        (k,) array
            Values of the term's parameters in that run.
        """
        places = self.places(run)
        # A place of -1 reads the last value, which is not used.
        return np.where(places < 0, otherwise, values[places])

    def expand(self, columns: NDArray, run: int) -> NDArray:
        """Expand the term's columns of one run to its width in the layout.

        Parameters
        ----------
        columns : (m, O, k) array
            Columns of one run.
        run : int
            Number of the run.

        Returns
        -------
        (m, O, width) array
            The same columns in their places; the others are zero.
        """
        places = self.places(run)
        return _spread(columns, np.where(places < 0, -1, places - self.start), self.width)


class Column(NamedTuple):
    """One column of a layout."""

    effect: Effect
    parameter: Parameter
    run: int | None
    """Number of the run that the column belongs to; None if runs share it."""

    @property
    def name(self) -> str:
        """Name in messages."""
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
            Kind of each run that is fitted.
        absent : collection of (int, int)
            Pairs of a term's and a run's number: runs that lack a term although their kind may have
            it.
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
        """(q,) whether each column of one run's regressor belongs to that run alone."""
        return np.array([own for term in self.terms for own in term.per_run], dtype=bool)

    @property
    def bodies(self) -> NDArray:
        """Columns of each rigid body, (bodies, parameters); the machine's body is first."""
        # Bodies are the same in all runs, so that all their columns are shared.
        return np.array([t.places(None) for t in self.terms if isinstance(t.effect, RigidBody)])

    def bodies_in(self, kind: str) -> NDArray:
        """Return the columns of each body that moves in a kind of run.

        Parameters
        ----------
        kind : str
            ``exo_alone`` or ``with_human``.

        Returns
        -------
        (bodies, parameters) int array
            One body alone, two with a person.
        """
        # The wearer's body adds to the machine's, which moves in every run.
        return self.bodies if kind == "with_human" else self.bodies[:1]

    def acting_in(self, kind: str) -> NDArray:
        """Return which columns act in a kind of run.

        Parameters
        ----------
        kind : str
            ``exo_alone`` or ``with_human``.

        Returns
        -------
        (p,) bool array
            False for columns of effects or runs of the other kind.
        """
        acts = (
            column.effect.acts(kind) if column.run is None else self.kinds[column.run] == kind
            for column in self.columns
        )
        return np.array(list(acts), dtype=bool)

    def shapes(self, term: int) -> slice:
        """Return the places of a term's shape values.

        Parameters
        ----------
        term : int
            Number of the term.

        Returns
        -------
        slice
            Into a vector of p columns followed by all shape values.
        """
        counts = [len(one.effect.shape) for one in self.terms]
        start = self.size + sum(counts[:term])
        return slice(start, start + counts[term])

    def select(self, values: NDArray, run: int | None) -> NDArray:
        """Return the values of one run's regressor, zero for parameters without a column.

        Parameters
        ----------
        values : (p,) array
            Values of all columns.
        run : int or None
            Number of the run; None for a run that was not fitted.

        Returns
        -------
        (q,) array
            In the order of that run's regressor.
        """
        parts = [term.select(values, run, np.zeros(len(term.per_run))) for term in self.terms]
        return np.concatenate(parts)

    def expand(
        self,
        columns: NDArray,
        run: int | None,
        terms: Iterable[int] | None = None,
    ) -> NDArray:
        """Expand the columns of one run's regressor to the whole layout.

        Parameters
        ----------
        columns : (m, O, q) array
            Regressor of one run.
        run : int or None
            Number of the run; None for a run that was not fitted.
        terms : iterable of int, optional
            Numbers of the terms that the regressor has; all by default.

        Returns
        -------
        (m, O, p) array
            The same columns in their places; the others are zero.
        """
        chosen = self.terms if terms is None else [self.terms[term] for term in terms]
        places = np.concatenate([term.places(run) for term in chosen])
        return _spread(columns, places, self.size)


def _spread(columns: NDArray, places: NDArray, width: int) -> NDArray:
    """Place columns (m, O, k) among zeros, (m, O, width).

    ``places`` (k,) are their places; those at -1 are dropped.
    """
    # Without columns of single runs nothing moves, and a large array need not be copied.
    if np.array_equal(places, np.arange(width)):
        return columns
    there = places >= 0
    wide = np.zeros((*columns.shape[:-1], width))
    wide[..., places[there]] = columns[..., there]
    return wide
