"""Speed of ``exoid diagnose``: its posterior against refits, its time against recordings' length
and catalogue.

Run with ``python -m tests.campaigns.bench.bench_diagnose``.
Times are processor time of one core, so that a
busy machine does not decide.
"""

import os

# Before NumPy is loaded: one core is what is asked about.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import time
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from typing import TypeVar
from unittest.mock import patch

import numpy as np

from pipelines.diagnosis.candidates.library import Library, build_library
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.evidence.order_tracking import lines_in
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns, prepare
from pipelines.diagnosis.selection.evidence import Evidence, _stack
from pipelines.diagnosis.selection.posterior import posterior
from pipelines.effects import EFFECTS
from pipelines.mechanics.motion import Motion
from pipelines.model import BASELINE
from tests.campaigns.bench.report import Row, show
from tests.diagnosis.sessions import session

T = TypeVar("T")
HIDDEN = {
    "effect": "stribeck_friction",
    "joint": "knee",
    "stribeck_torque": 2.0,
    "stribeck_velocity": 0.15,
}
SECONDS = 70.0
"""Of each of a session's four recordings."""
SAMPLE = 50
"""Pairs of elements that are refitted from their rows."""


def rows() -> Iterator[Row]:
    """Measure."""
    diagnose(recorded(15.0))  # compiles
    yield from posterior_rows(recorded(SECONDS), SAMPLE)
    yield from length_rows((0.5 * SECONDS, SECONDS, 2.0 * SECONDS))
    yield from catalogue_rows(recorded(SECONDS), (4, 2, 1))
    yield from order_rows(recorded(SECONDS))


def recorded(seconds: float) -> list[Motion]:
    """Return a session at 200 Hz in which one cause is hidden."""
    return session(seconds=seconds, **HIDDEN)


def prepared_from(motions: Sequence[Motion]) -> PreparedRuns:
    """Return the training runs under the baseline."""
    runs = [observe(m) for m in motions if m.purpose == "train"]
    return prepare(runs, baseline_of(runs))


def posterior_rows(motions: Sequence[Motion], sample: int) -> Iterator[Row]:
    """The library, the posterior from Gram matrices, and pairs of elements refitted from their
    rows."""
    prepared = prepared_from(motions)
    built, library = seconds_of(lambda: build_library(prepared))
    yield Row(
        f"library: {len(library.causes)} shapes, {len(library.laws)} columns of laws",
        f"{built:.2f} s",
    )
    multiplied, evidence = seconds_of(lambda: Evidence.of(library, {}))
    weighed, found = seconds_of(lambda: posterior(evidence))
    ours = multiplied + weighed
    yield Row(
        f"posterior over {len(evidence.elements)} elements: {len(found.sets)} sets in full",
        f"{ours:.2f} s, {multiplied:.2f} s of it multiplying out",
    )
    naive, pairs = refits_of_pairs(library, evidence, sample)
    yield Row(
        f"lstsq on all {pairs} pairs of elements, scaled up from {sample}",
        f"{naive:.1f} s",
        naive / ours,
    )


def refits_of_pairs(library: Library, evidence: Evidence, sample: int) -> tuple[float, int]:
    """Return how long refits of all pairs of elements take that begin with their rows, and how many
    there are."""
    columns, _ = _stack(library)
    elements = evidence.elements
    pairs = [(one, other) for one, other in combinations(elements, 2) if one.label != other.label]
    chosen = np.random.default_rng(0).choice(len(pairs), sample, replace=False)
    baseline, y = library.regression.baseline, library.regression.torque_rows
    places = [[p for e in pairs[n] for p in (*e.columns, *e.derivative)] for n in chosen]
    wide = [np.hstack([baseline, columns[:, own]]) for own in places]
    taken, _ = seconds_of(lambda: [np.linalg.lstsq(A, y, rcond=None) for A in wide])
    return len(pairs) * taken / sample, len(pairs)


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
            f"{taken:.1f} s, {taken / first:.1f} times the first's",
            wanted=wanted,
        )


def catalogue_rows(motions: Sequence[Motion], every: Sequence[int]) -> Iterator[Row]:
    """The whole diagnosis against the number of effects to choose from: every fourth of the
    catalogue, and so on."""
    causes = [effect for effect in EFFECTS if effect.name not in BASELINE]
    for step in every:
        some = tuple(causes[::step])
        with patch("pipelines.diagnosis.candidates.candidate.EFFECTS", some):
            taken, found = seconds_of(lambda: diagnose(motions))
        yield Row(
            f"  {len(some)} effects to choose from, {len(found.selected.library.causes)} shapes",
            f"{taken:.1f} s",
        )


def order_rows(motions: Sequence[Motion]) -> Iterator[Row]:
    """Order tracking of four runs, without lines and with four at one joint."""
    runs = [observe(motion) for motion in motions]
    prepared = prepare(runs, baseline_of(runs))
    left = [run.motion.torque - x for run, x in zip(prepared.runs, prepared.predicted, strict=True)]
    ripple = [sum(0.5 * np.sin(n * m.q[:, 1]) for n in (35.0, 88.3, 200.0, 351.0)) for m in motions]
    rippled = [np.column_stack([x[:, 0], x[:, 1] + r]) for x, r in zip(left, ripple, strict=True)]
    for name, residuals in (("no line", left), ("four lines at a joint", rippled)):
        taken, found = seconds_of(lambda residuals=residuals: lines_in(motions, residuals))
        count = sum(len(joint.lines) for joint in found)
        yield Row(
            f"order tracking, {name} ({count} found)", f"{1e3 * taken:.0f} ms", wanted="150 ms"
        )


def seconds_of(work: Callable[[], T]) -> tuple[float, T]:
    """Return processor time and result."""
    began = time.process_time()
    result = work()
    return time.process_time() - began, result


if __name__ == "__main__":
    show("exoid diagnose", rows())
