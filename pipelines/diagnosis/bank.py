"""Every candidate's columns at every shape, multiplied out once."""

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate, columns_under, gram_of_runs, proposals, signatures
from pipelines.diagnosis.gram import Gram, error, gram_of, solve
from pipelines.diagnosis.observations import FOLDS, Baseline, Run, with_load
from pipelines.diagnosis.scan import Scan, worth_a_look
from pipelines.mechanics.geometry import Geometry
from pipelines.model import TermColumns

PASSES = 3
ROWS = 4096
"""Blocks whose columns stand side by side in memory: hours of them would be gigabytes."""
Report = Callable[[float, str], None]


def silent(share: float, what: str) -> None:
    """Report to nobody."""


@dataclass(frozen=True)
class Bank:
    """Products of the baseline's and all candidates' columns over the training runs."""

    runs: tuple[Run, ...]
    baseline: Baseline
    candidates: tuple[Candidate, ...]
    columns: tuple[TermColumns, ...]
    """Each candidate's columns in ``gram``; the baseline's come first."""
    gram: Gram
    weights: NDArray
    """(O,) inverse variance of each output under the baseline."""

    @property
    def geometry(self) -> Geometry:
        """Lengths and gravity of the machine."""
        return self.runs[0].motion.geometry

    def columns_of(self, chosen: Sequence[int]) -> NDArray:
        """Return the columns of the baseline and some candidates, (c,) places in ``gram``."""
        return np.r_[slice(0, self.baseline.size), *(self.columns[i].slice for i in chosen)]


def weights_under(gram: Gram) -> NDArray:
    """Return each output's inverse variance under the fit to all columns, iterated, (O,) 1/(N·m)²."""
    counts = gram.count.sum(axis=0)
    weights = np.where(counts > 0, 1.0, 0.0)
    for _ in range(PASSES):
        squares = error(gram, solve(gram, weights))
        weights = np.where(counts > 0, counts / np.maximum(squares, 1e-9 * np.maximum(counts, 1)), 0.0)
    return weights


def fill(
    runs: Sequence[Run], baseline: Baseline, report: Callable[[float, str], None] = lambda share, what: None
) -> Bank:
    """Compute every candidate's columns; ``report`` is told the share done and the effect at hand."""
    untouched = [columns_under((), run, baseline)[0] for run in runs]
    plain = gram_of_runs(runs, untouched)
    weights = weights_under(plain)
    runs = [with_load(run, baseline, solve(plain, weights)) for run in runs]
    scan = Scan.of(runs, untouched, weights)
    candidates: list[Candidate] = []
    places: list[TermColumns] = []
    columns = [untouched]
    at = baseline.size
    kinds = [run.motion.run for run in runs]
    effects = list(proposals(baseline, kinds))
    for number, effect in enumerate(effects):
        report(number / len(effects), effect.label)
        for candidate in worth_a_look(effect, scan):
            own = candidate.columns_in(kinds, start=at)
            narrow = signatures(candidate, runs, baseline, untouched, weights)
            made = [own.expand(column, r) for r, column in enumerate(narrow)]
            if not all(np.isfinite(column).all() for column in made):  # a shape that tears the motion apart
                continue
            candidates.append(candidate)
            places.append(own)
            columns.append(made)
            at += own.width
    return Bank(tuple(runs), baseline, tuple(candidates), tuple(places), _multiplied_out(runs, columns), weights)


def _multiplied_out(runs: Sequence[Run], columns: Sequence[Sequence[NDArray]]) -> Gram:
    """Return the products of all columns, each a list over runs: side by side only some rows at a time."""
    grams = (
        gram_of(
            np.concatenate([column[r][rows] for column in columns], axis=2),
            run.measured[rows], run.usable[rows], run.fold[rows], FOLDS,
        )
        for r, run in enumerate(runs)
        for rows in (slice(first, first + ROWS) for first in range(0, len(run.time), ROWS))
    )  # fmt: skip
    return reduce(operator.add, grams)
