"""Learns the criteria from stored evidence, with forms or worlds left out where asked."""

import json
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import Criteria
from tests.blind.splits import fold_of
from tests.learn.objective import Scores, Session, reduced, rows
from tests.learn.search import ODDS, ascend
from tests.learn.vector import from_vector, names, plain_values, to_vector

ROUNDS = 2
"""Times that the sets which matter are sought anew, under the criteria learned so far."""


def learn(
    root: Path, worlds: Sequence[str], left_out: set[int], most: int, workers: int,
    start: Criteria,
) -> dict[str, Any]:  # fmt: skip
    """Return the learned criteria, the scores before and after, and what they were learned from."""
    criteria, history = start, []
    for _ in range(ROUNDS):
        with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
            sessions = list(_sessions(root, worlds, left_out, most, pool, criteria))
        weights, scores = _weights(sessions), Scores(sessions, workers)
        before = float(weights @ scores(criteria))
        criteria, after = _ascended(scores, weights, criteria)
        scores.close()
        history.append({"sessions": len(sessions), "before": before, "after": after})
        print(f"{len(sessions)} sessions: {before:.4f} -> {after:.4f}", flush=True)
    return {
        "criteria": asdict(criteria), "history": history, "worlds": list(worlds),
        "left_out": sorted(left_out),
    }  # fmt: skip


def _sessions(
    root: Path, worlds: Sequence[str], left_out: set[int], most: int, pool: Executor,
    criteria: Criteria,
) -> Iterator[Session]:  # fmt: skip
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


def _weights(sessions: Sequence[Session]) -> NDArray:
    """Return weights that give each world the same say, (n,); they add up to one."""
    worlds = [session.world for session in sessions]
    counts = {world: worlds.count(world) for world in set(worlds)}
    return np.array([1.0 / (len(counts) * counts[world]) for world in worlds])


def _ascended(scores: Scores, weights: NDArray, criteria: Criteria) -> tuple[Criteria, float]:
    scale = np.where([value < 0.0 for value in plain_values(criteria)], ODDS, 1.0)

    def score(vector: NDArray) -> float:
        return float(weights @ scores(from_vector(vector, criteria)))

    began, places = time.monotonic(), names()

    def report(place: int, value: float) -> None:
        print(f"{time.monotonic() - began:6.0f} s {places[place]:24s} {value:.4f}", flush=True)

    best, value = ascend(score, to_vector(criteria), scale, report)
    return from_vector(best, criteria), value
