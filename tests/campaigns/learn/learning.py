"""Learns the criteria from stored evidence, with forms or worlds left out where asked."""

import json
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import asdict, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import Criteria
from pipelines.diagnosis.selection.prior import FEATURES, weights
from tests.campaigns.blind.splits import fold_of
from tests.campaigns.learn.objective import LogEvidence, Session, padded, reduced, revisions, rows
from tests.campaigns.learn.prior_fit import Sets
from tests.campaigns.learn.search import ascend
from tests.campaigns.learn.vector import from_vector, names, to_vector

ROUNDS = 2
"""Times that the sets which matter are sought again, under the criteria learned so far."""


def learn(
    root: Path,
    worlds: Sequence[str],
    left_out: set[int],
    most: int,
    workers: int,
    start: Criteria,
) -> dict[str, Any]:
    """Return the learned criteria, the scores before and after, and what they were learned from."""
    # The sessions have a base rate of their own.
    criteria, history = replace(start, base_rate=0.0), []
    for _ in range(ROUNDS):
        with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
            sessions = list(sessions_of(root, worlds, left_out, most, pool, criteria))
        weigh = LogEvidence(sessions, workers)
        criteria, before, after = ascended(weigh, sets_of(sessions), criteria)
        weigh.close()
        history.append(
            {
                "sessions": len(sessions),
                "revision": revisions(sessions),
                "before": before,
                "after": after,
            }
        )
        print(f"{len(sessions)} sessions: {before:.4f} -> {after:.4f}", flush=True)
    seeds = [session.truth["case"]["seed"] for session in sessions]
    return {
        "criteria": asdict(replace(criteria, base_rate=start.base_rate)),
        "history": history,
        "seeds": [min(seeds), max(seeds)],
        "worlds": list(worlds),
        "left_out": sorted(left_out),
    }


def sessions_of(
    root: Path,
    worlds: Sequence[str],
    left_out: set[int],
    most: int,
    pool: Executor,
    criteria: Criteria,
) -> Iterator[Session]:
    """Yield sessions, none that hides a form which is left out or held back."""
    count: dict[str, int] = {}
    jobs = []
    for row in rows(root, worlds):
        count[row["world"]] = count.get(row["world"], 0) + 1
        if count[row["world"]] <= most:
            jobs.append((row, criteria, left_out))
    for session in pool.map(_reduced, jobs, chunksize=4):
        if session is not None:
            yield session


def _reduced(job: tuple[dict[str, Any], Criteria, set[int]]) -> Session | None:
    row, criteria, left_out = job
    truth = json.loads(row["truth"])
    hidden = truth["hidden"]
    if truth["case"]["category"] == "fault" or any(h.get("held_back") for h in hidden):
        return None
    if any(fold_of(h["effect"], h["form"]) in left_out for h in hidden):
        return None
    return reduced(row, criteria)


def sets_of(sessions: Sequence[Session]) -> Sets:
    """Return what the prior's fit needs of sessions."""
    features = padded([session.features for session in sessions], 0.0)
    right = padded([session.right.astype(float) for session in sessions], 0.0)
    return Sets(features, right, _weights(sessions))


def _weights(sessions: Sequence[Session]) -> NDArray:
    """Return weights that give each world the same say, (n,); they add up to one."""
    worlds = [session.world for session in sessions]
    counts = {world: worlds.count(world) for world in set(worlds)}
    return np.array([1.0 / (len(counts) * counts[world]) for world in worlds])


def ascended(weigh: LogEvidence, sets: Sets, criteria: Criteria) -> tuple[Criteria, float, float]:
    """Return the best criteria found, and the scores at first and at last."""
    prior = weights(criteria)
    first = float(sets.weights @ sets.scores(weigh(criteria), prior))
    began, places = time.monotonic(), names()

    def score(vector: NDArray) -> tuple[float, NDArray]:
        prior_weights, value = sets.fit(weigh(from_vector(vector, criteria)), prior)
        return value, prior_weights

    def report(place: int, value: float) -> None:
        print(f"{time.monotonic() - began:6.0f} s {places[place]:24s} {value:.4f}", flush=True)

    best, value, prior = ascend(score, to_vector(criteria), report)
    learned = dict(zip(FEATURES, prior.tolist(), strict=True))
    return replace(from_vector(best, criteria), **learned), first, value
