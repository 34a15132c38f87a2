"""Every candidate's columns at every shape, multiplied out once."""

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate, expanded, gram_of_runs, proposals, signatures
from pipelines.diagnosis.gram import Gram, error, gram_of, solve
from pipelines.diagnosis.observations import FOLDS, Baseline, Run, residuals_at_full_rate, with_load
from pipelines.diagnosis.order_tracking import lines_in
from pipelines.diagnosis.scan import Scan, worth_a_look
from pipelines.mechanics.geometry import Geometry

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
    where: tuple[slice, ...]
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
        parts = [np.arange(self.baseline.size)]
        parts += [np.arange(self.where[i].start, self.where[i].stop) for i in chosen]
        return np.concatenate(parts)


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
    motions = [run.motion for run in runs]
    untouched = [run.average(baseline.columns(run.motion, run.motion, run.motion)) for run in runs]
    plain = gram_of_runs(runs, untouched)
    weights = weights_under(plain)
    values = solve(plain, weights)
    runs = [with_load(run, baseline, values) for run in runs]
    scan = Scan.of(runs, untouched, weights, lines_in(motions, residuals_at_full_rate(runs, baseline, values)))
    candidates: list[Candidate] = []
    where: list[slice] = []
    columns = [untouched]
    at = baseline.size
    effects = [e for e in proposals(baseline, [m.run for m in motions]) if e.shows_in(motions)]
    for number, effect in enumerate(effects):
        report(number / len(effects), effect.label)
        known: dict[tuple[float, ...], list[NDArray]] = {}
        for candidate in worth_a_look(effect, scan):
            shared = signatures(candidate, runs, baseline, untouched, weights, known)
            made = expanded(shared, effect, candidate.signature_apart, runs)
            if not all(np.isfinite(column).all() for column in made):  # a shape that tears the motion apart
                continue
            candidates.append(candidate)
            where.append(slice(at, at + made[0].shape[2]))
            columns.append(made)
            at += made[0].shape[2]
    return Bank(tuple(runs), baseline, tuple(candidates), tuple(where), _multiplied_out(runs, columns), weights)


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
