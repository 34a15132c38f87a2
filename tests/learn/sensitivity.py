"""How much each criterion matters: what a change by 30 % does to the probability of the truth."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import Criteria
from pipelines.diagnosis.selection.prior import FEATURES, weights
from tests.learn.learning import sessions_of, sets_of
from tests.learn.objective import LogEvidence
from tests.learn.prior_fit import Sets
from tests.learn.vector import from_vector, names, to_vector

TITLE = "How much each matters"
CHANGE = 1.3
"""Factor by which a number is changed, up and down."""
COLUMNS = ("changed by 30 %", "ln p, larger", "ln p, smaller", "right first, larger", "right first, smaller")
ABOUT = """\
Measured by `make sensitivity` on {sessions} simulated sessions whose evidence is stored. As they
stand the criteria give the truth a mean log probability of {score:.3f}, and the most probable set
is the truth in {share:.1%}. The table has the changes of both where one number is multiplied or
divided by 1.3, all else as it stands. What is not learned is there only where it is part of the prior."""


def sensitivity(root: Path, worlds: Sequence[str], most: int, workers: int, criteria: Criteria) -> dict[str, Any]:
    """Return what was measured, as the page of the criteria shows it."""
    criteria = replace(criteria, base_rate=0.0)  # the sessions have one of their own
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        sessions = list(sessions_of(root, worlds, set(), most, pool, criteria))
    weigh, sets = LogEvidence(sessions, workers), sets_of(sessions)
    as_it_is = weigh(criteria)
    score, share = told_of(sets, as_it_is, criteria)
    rows = []
    for name, *changed in changes(criteria):
        by_prior = name in FEATURES
        results = [told_of(sets, as_it_is if by_prior else weigh(one), one) for one in changed]
        scores = [f"{own - score:+.3f}" for own, _ in results]
        shares = [f"{100.0 * (own - share):+.1f} %" for _, own in results]
        rows.append([f"`{name}`", *scores, *shares])
    weigh.close()
    about = ABOUT.format(sessions=len(sessions), score=score, share=share)
    return {"about": about, "columns": list(COLUMNS), "rows": rows}


def changes(criteria: Criteria) -> Iterator[tuple[str, Criteria, Criteria]]:
    """Yield each number's name, and the criteria with it larger and smaller."""
    vector = to_vector(criteria)
    for place, name in enumerate(names()):
        step = np.zeros(len(vector))
        step[place] = np.log(CHANGE)
        yield name, from_vector(vector + step, criteria), from_vector(vector - step, criteria)
    for name in FEATURES:
        value = getattr(criteria, name)
        yield name, replace(criteria, **{name: value * CHANGE}), replace(criteria, **{name: value / CHANGE})


def told_of(sets: Sets, evidence: NDArray, criteria: Criteria) -> tuple[float, float]:
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
