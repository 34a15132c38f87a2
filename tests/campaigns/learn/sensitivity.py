"""How much each criterion matters: what a change by 30 %, or its neutral value, does to the truth's
probability."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import BEFORE_EVIDENCE, Criteria
from pipelines.diagnosis.selection.prior import FEATURES, weights
from tests.campaigns.learn.learning import sessions_of, sets_of
from tests.campaigns.learn.objective import LogEvidence, revisions
from tests.campaigns.learn.prior_fit import Sets

TITLE = "How much each matters"
CHANGE = 1.3
"""Factor by which a number is changed, up and down."""
COLUMNS = (
    "changed",
    "ln p, larger",
    "ln p, smaller",
    "ln p, neutral",
    "right first, larger",
    "right first, smaller",
    "right first, neutral",
)
ABOUT = """\
Measured by `make sensitivity` on {sessions} simulated sessions of seeds for tuning,
whose evidence was stored by revision {revisions}. As they stand the criteria give the truth a mean
log probability of {score:.3f}, and the most probable set is the truth in {share:.1%}. The table has
the changes of both where one number is multiplied by 1.3 (larger), divided by 1.3 (smaller), or set
to its neutral value, all else as it stands. Neutral is one for weights and lines, which then count
in full; one of several values is then not there; all else is zero. Eight numbers have no row: three
act before evidence is stored, the base rate is the sessions' own, and four change no
probability."""
NOT_MEASURED = (
    *BEFORE_EVIDENCE,
    "base_rate",
    "named_from",
    "tied_from",
    "at_floor",
    "left_of_explained",
)
"""Criteria that do not change the probability of the truth, given stored evidence."""
NEUTRAL = {"drive_weight": 1.0, "cuff_weight": 1.0, "line_weight": 1.0, "shape_sd": 1e-6}
"""Neutral values, where they are not zero."""


def sensitivity(
    root: Path, worlds: Sequence[str], most: int, workers: int, criteria: Criteria
) -> dict[str, Any]:
    """Return what was measured, as the page of the criteria shows it."""
    criteria = replace(criteria, base_rate=0.0)  # the sessions have one of their own
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        sessions = list(sessions_of(root, worlds, set(), most, pool, criteria))
    weigh, sets = LogEvidence(sessions, workers), sets_of(sessions)
    as_it_is = weigh(criteria)
    score, share = score_and_share(sets, as_it_is, criteria)
    rows = []
    for name, *changed in changes(criteria):
        by_prior = name in FEATURES
        results = [
            score_and_share(sets, as_it_is if by_prior else weigh(one), one) for one in changed
        ]
        scores = [f"{own - score:+.3f}" for own, _ in results]
        shares = [f"{100.0 * (own - share):+.1f} %" for _, own in results]
        rows.append([f"`{name}`", *scores, *shares])
    weigh.close()
    about = ABOUT.format(
        sessions=len(sessions), revisions=revisions(sessions), score=score, share=share
    )
    return {"about": about, "columns": list(COLUMNS), "rows": rows}


def changes(criteria: Criteria) -> Iterator[tuple[str, Criteria, Criteria, Criteria]]:
    """Yield each number's name, and the criteria with it larger, smaller, and neutral."""
    for field in fields(Criteria):
        name, value = field.name, getattr(criteria, field.name)
        if name in NOT_MEASURED:
            continue
        if not isinstance(value, tuple):
            other = (value * CHANGE, value / CHANGE, NEUTRAL.get(name, 0.0))
            yield name, *(replace(criteria, **{name: one}) for one in other)
            continue
        for k, one in enumerate(value):
            before, after = value[:k], value[k + 1 :]
            parts = ((one * CHANGE,), (one / CHANGE,), ())
            yield (
                f"{name}[{k}]",
                *(replace(criteria, **{name: (*before, *part, *after)}) for part in parts),
            )


def score_and_share(sets: Sets, evidence: NDArray, criteria: Criteria) -> tuple[float, float]:
    """Return the mean log probability of the truth, and how often it is the most probable set.

    Parameters
    ----------
    evidence : NDArray
        (n, sets) log Bayes factors under the criteria.
    """
    prior = weights(criteria)
    first = np.argmax(evidence + sets.features @ prior, axis=1)
    is_right = np.take_along_axis(sets.right, first[:, np.newaxis], axis=1)[:, 0]
    return float(sets.weights @ sets.scores(evidence, prior)), float(sets.weights @ is_right)
