"""Speed of ``exoid diagnose``: its search against a naive one, its time against recordings' length and catalogue.

Run with ``python -m tests.bench.bench_diagnose``. Times are processor time of one core, so that a busy machine does
not decide.
"""

import os

# Before NumPy is loaded: one core is what is asked about.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import comb
from typing import TypeVar
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from pipelines.diagnosis.bank import Bank, fill
from pipelines.diagnosis.search import MOST, Scored, Scorer, search

from pipelines.diagnosis.candidates.candidate import BASELINE
from pipelines.diagnosis.candidates.columns import signatures
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.baseline_columns import columns_under, gram_of_runs
from pipelines.diagnosis.evidence.noise_floor import MOST_INDEPENDENT
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.effects import EFFECTS
from pipelines.mechanics.motion import Motion
from tests.bench.report import Row, show
from tests.diagnosis.sessions import session

T = TypeVar("T")
HIDDEN = {"effect": "stribeck_friction", "joint": "knee", "stribeck_torque": 2.0, "stribeck_velocity": 0.15}
SECONDS = 70.0
"""Of each of a session's four recordings."""
SAMPLE = 20
"""Combinations of each size that the naive search is timed on."""


def rows() -> Iterator[Row]:
    """Measure."""
    diagnose(recorded(15.0))  # compiles
    yield from search_rows(recorded(SECONDS), SAMPLE)
    yield from length_rows((0.5 * SECONDS, SECONDS, 2.0 * SECONDS))
    yield from catalogue_rows(recorded(SECONDS), (4, 2, 1))
    yield from order_rows(recorded(SECONDS))


def recorded(seconds: float) -> list[Motion]:
    """Return a session at 200 Hz in which one cause is hidden."""
    return session(seconds=seconds, **HIDDEN)


def search_rows(motions: Sequence[Motion], sample: int) -> Iterator[Row]:
    """One, two and three causes from Gram matrices, and by a refit of every combination."""
    runs = [observe(m) for m in motions if m.purpose == "train"]
    baseline = baseline_of(runs)
    bank = fill(runs, baseline)
    columns = all_columns(bank)
    multiplied, _ = seconds_of(lambda: gram_of_runs(bank.runs, columns))
    counted = Counting(bank, bank.gram.count.sum(axis=0) * MOST_INDEPENDENT)
    searched, _ = seconds_of(lambda: search(counted))
    ours = multiplied + searched
    yield Row(
        f"search, {MOST} causes: {len(bank.candidates)} shapes, {sum(counted.sets.values())} sets",
        f"{ours:.2f} s, {multiplied:.2f} s of it multiplying out",
    )
    naive = Naive.of(bank, columns, sample)
    labels = len({c.label for c in bank.candidates})
    every = sum(comb(labels, size) * naive.seconds[size] for size in range(1, MOST + 1))
    number = sum(comb(labels, size) for size in range(1, MOST + 1))
    yield Row(f"lstsq on all {number} sets of {labels} causes, one shape each *", f"{every:.0f} s", every / ours, "50")
    same = sum(count * naive.seconds[size] for size, count in counted.sets.items())
    yield Row("lstsq on the sets that the search tries *", f"{same:.0f} s", same / ours)
    each = ", ".join(f"{1e3 * naive.seconds[size]:.0f}" for size in range(1, MOST + 1))
    yield Row(f"  * scaled up from {sample} sets each of 1, 2, 3 causes", f"{each} ms a set")


def all_columns(bank: Bank) -> list[NDArray]:
    """Return the columns that were multiplied out, (m, O, c) for each training run."""
    untouched = [columns_under((), run, bank.baseline)[0] for run in bank.runs]
    made = []
    for candidate, own in zip(bank.candidates, bank.columns, strict=True):
        narrow = signatures(candidate, bank.runs, bank.baseline, untouched, bank.weights)
        made.append([own.expand(column, r) for r, column in enumerate(narrow)])
    return [np.concatenate([untouched[r], *(one[r] for one in made)], axis=2) for r in range(len(bank.runs))]


class Counting(Scorer):
    """A scorer that counts the sets of each size it is asked for."""

    def __init__(self, bank: Bank, independent: NDArray) -> None:
        self.sets: dict[int, int] = {}
        super().__init__(bank, independent, evidence={})

    def __call__(self, chosen: Sequence[int]) -> Scored:
        self.sets[len(chosen)] = self.sets.get(len(chosen), 0) + 1
        return super().__call__(chosen)


@dataclass(frozen=True)
class Naive:
    """A search that stacks the columns of each set and refits: how long one set of each size takes."""

    seconds: dict[int, float]

    @classmethod
    def of(cls, bank: Bank, columns: Sequence[NDArray], sample: int) -> "Naive":
        """Time random sets of each size; one fit a set, and none held out, which would take as many fits as folds."""
        roots = [np.sqrt(bank.weights) * run.usable for run in bank.runs]
        rows = [root.ravel() > 0 for root in roots]
        flat = np.concatenate(
            [(c * r[..., np.newaxis]).reshape(-1, c.shape[2])[n] for c, r, n in zip(columns, roots, rows, strict=True)]
        )
        y = np.concatenate([(run.measured * r).ravel()[n] for run, r, n in zip(bank.runs, roots, rows, strict=True)])
        draw = np.random.default_rng(0)
        seconds = {}
        for size in range(1, MOST + 1):
            sets = [draw.choice(len(bank.candidates), size, replace=False) for _ in range(sample)]
            taken, _ = seconds_of(
                lambda sets=sets: [np.linalg.lstsq(flat[:, bank.columns_of(chosen)], y) for chosen in sets]
            )
            seconds[size] = taken / sample
        return cls(seconds)


def length_rows(lengths: Sequence[float]) -> Iterator[Row]:
    """The whole diagnosis against the length of four recordings at 200 Hz."""
    first = 0.0
    for seconds in lengths:
        motions = recorded(seconds)
        taken, found = seconds_of(lambda motions=motions: diagnose(motions))
        first = first or taken
        wanted = "10 s" if seconds == SECONDS else ""
        yield Row(
            f"diagnosis of 4 x {seconds:g} s ({len(found.causes)} named)",
            f"{taken:.1f} s, {taken / first:.1f} times the first's", wanted=wanted,
        )  # fmt: skip


def catalogue_rows(motions: Sequence[Motion], every: Sequence[int]) -> Iterator[Row]:
    """The whole diagnosis against the number of effects to choose from: every fourth of the catalogue, and so on."""
    causes = [effect for effect in EFFECTS if effect.name not in BASELINE]
    for step in every:
        some = tuple(causes[::step])
        with patch("pipelines.diagnosis.candidates.EFFECTS", some):
            taken, found = seconds_of(lambda: diagnose(motions))
        yield Row(f"  {len(some)} effects to choose from, {len(found.bank.candidates)} shapes", f"{taken:.1f} s")


def order_rows(motions: Sequence[Motion]) -> Iterator[Row]:
    """Order tracking of four runs, without lines and with four at one joint."""
    runs = [observe(motion) for motion in motions]
    baseline = baseline_of(runs)
    values = fit((), runs, baseline, np.ones(2 * len(baseline.joints))).values
    left = residuals_at_full_rate(runs, baseline, values)
    ripple = [sum(0.5 * np.sin(n * m.q[:, 1]) for n in (35.0, 88.3, 200.0, 351.0)) for m in motions]
    rippled = [np.column_stack([x[:, 0], x[:, 1] + r]) for x, r in zip(left, ripple, strict=True)]
    for name, residuals in (("no line", left), ("four lines at a joint", rippled)):
        taken, found = seconds_of(lambda residuals=residuals: lines_in(motions, residuals))
        count = sum(len(joint.lines) for joint in found)
        yield Row(f"order tracking, {name} ({count} found)", f"{1e3 * taken:.0f} ms", wanted="150 ms")


def seconds_of(work: Callable[[], T]) -> tuple[float, T]:
    """Return processor time and result."""
    began = time.process_time()
    result = work()
    return time.process_time() - began, result


if __name__ == "__main__":
    show("exoid diagnose", rows())
