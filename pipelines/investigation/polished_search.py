"""Search of an excitation by a criterion that takes milliseconds instead of microseconds.

Motions are repaired as in any other search. The swarm does not fly: its best particle is polished.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipelines.design.evolution import polish
from pipelines.design.excitation import Design
from pipelines.design.fitness import Problem, costs
from pipelines.design.quality import quality
from pipelines.design.search import (
    Report,
    candidate_of,
    first_swarm,
    search_problem,
    spread_of,
    trajectory_of,
)
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.design import DesignSettings

Cost = Callable[[Trajectory, float], tuple[float, str]]
"""Takes an excitation and its log det; returns what is minimized, and a note of the best so far."""
FAR, NEAR = 0.1, 0.02
"""Scales of the first steps: a motion that an earlier search returned is near its optimum."""


def polished_search(
    settings: DesignSettings,
    geometry: Geometry,
    cost: Cost,
    report: Report,
    check: Callable[[Trajectory], None] = lambda motion: None,
    last: Trajectory | None = None,
) -> Design:
    """Return the best excitation.

    Equal settings give an equal excitation, unless ``seconds`` ended the search.

    Parameters
    ----------
    settings : DesignSettings
        Of the search; the criterion is ``cost``.
    geometry : Geometry
        Lengths and gravity.
    cost : callable
        What is minimized.
    report : callable
        Called with the share that is done, 0 to 1, and a note.
    check : callable, optional
        Called first, with the motion of the largest log det in the first swarm; may refuse.
    last : Trajectory, optional
        Of the last experiment: where the search can reach it, its result is no worse.
    """
    rng = np.random.default_rng(settings.seed)
    # Repair and start are by log det. Settings of a multisine do that too, on its lines alone.
    on_lines = settings.criterion == "multisine"
    by_log_det = settings if on_lines else settings.model_copy(update={"criterion": "log_det"})
    problem = search_problem(by_log_det, geometry, samples=200, samples_per_harmonic=40)
    search = _Search(problem, cost, report, time.monotonic() + settings.seconds)
    swarm = first_swarm(settings, problem, spread_of(problem), rng)
    check(trajectory_of(swarm.position[np.argmin(costs(swarm.position, problem))], problem))
    starts = [(swarm.position[np.argmin(search.costs_of(swarm.position))], FAR)]
    if last is not None and (again := candidate_of(last, problem)) is not None:
        starts.append((again, NEAR))
    best, best_cost = starts[0][0], np.inf
    for i, (start, scale) in enumerate(starts):
        done = 0.5 * (1.0 + i / len(starts))
        candidate, value = search.polished(start, scale, rng, done)
        if value < best_cost:
            best, best_cost = candidate, value
    stopped_by = "seconds" if search.out_of_time() else "stagnation"
    trajectory = trajectory_of(best, problem)
    return Design(trajectory, quality(trajectory, settings, geometry), settings, stopped_by)


@dataclass(frozen=True)
class _Search:
    """Candidates of one search and their costs."""

    problem: Problem
    cost: Cost
    report: Report
    deadline: float
    """Of the clock ``time.monotonic``, s."""

    def out_of_time(self) -> bool:
        """Return whether the deadline has passed."""
        return time.monotonic() > self.deadline

    def costs_of(self, candidates: NDArray, done: float = 0.0) -> NDArray:
        """Repair candidates (P, D) in place, and return their costs (P,).

        ``done`` is the share of the search that is done.
        """
        log_det = -costs(candidates, self.problem)  # repairs them
        pairs = zip(candidates, log_det, strict=True)
        judged = [self.cost(trajectory_of(one, self.problem), value) for one, value in pairs]
        self.report(done, judged[-1][1])
        return np.array([value for value, _ in judged])

    def polished(
        self, start: NDArray, scale: float, rng: np.random.Generator, done: float
    ) -> tuple[NDArray, float]:
        """Return the best candidate (D,) near a start (D,), and its cost."""
        # The start itself counts, which none of its neighbours may reach.
        at_start = float(self.costs_of(start[np.newaxis], done)[0])
        best, cost = polish(
            start,
            scale * spread_of(self.problem),
            partial(self.costs_of, done=done),
            rng,
            out_of_time=self.out_of_time,
            patience=12,
            least_gain=3e-3,
        )
        return (start, at_start) if at_start <= cost else (best, cost)
