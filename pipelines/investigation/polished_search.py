"""Search of an excitation by a criterion that takes milliseconds instead of microseconds.

Motions are repaired as in any other search. The swarm does not fly: its best particle is polished.
"""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipelines.design.evolution import polish
from pipelines.design.excitation import Design
from pipelines.design.fitness import costs
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


def polished_search(
    settings: DesignSettings,
    geometry: Geometry,
    cost: Cost,
    report: Report,
    check: Callable[[Trajectory], None] = lambda motion: None,
    last: Trajectory | None = None,
    least_gain: float = 3e-4,
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
        Of the last experiment: where the search can find it, its result is no worse.
    least_gain : float, optional
        Relative gain within ``patience`` generations below which the search stagnates.
    """
    patience = 12
    rng = np.random.default_rng(settings.seed)
    by_log_det = settings.model_copy(update={"criterion": "log_det"})
    problem = search_problem(by_log_det, geometry, samples=200, samples_per_harmonic=40)
    spread = spread_of(problem)
    deadline = time.monotonic() + settings.seconds
    done = 0.0

    def costs_of(candidates: NDArray) -> NDArray:
        log_det = -costs(candidates, problem)  # repairs them
        judged = [
            cost(trajectory_of(one, problem), value)
            for one, value in zip(candidates, log_det, strict=True)
        ]
        report(done, judged[-1][1])
        return np.array([value for value, _ in judged])

    swarm = first_swarm(settings, problem, spread, rng)
    check(trajectory_of(swarm.position[np.argmin(costs(swarm.position, problem))], problem))
    # Scales of the first steps: a motion that an earlier search has found is near its optimum.
    far, near = 0.1, 0.02
    starts = [(swarm.position[np.argmin(costs_of(swarm.position))], far)]
    if last and (again := candidate_of(last, problem)) is not None:
        starts.append((again, near))
    best, best_cost = starts[0][0], np.inf
    for i, (start, scale) in enumerate(starts):
        done = 0.5 * (1.0 + i / len(starts))
        # The start itself counts, which none of its neighbours may reach.
        for candidate, value in (
            (start, float(costs_of(start[np.newaxis])[0])),
            polish(
                start,
                scale * spread,
                costs_of,
                rng,
                out_of_time=lambda: time.monotonic() > deadline,
                patience=patience,
                least_gain=least_gain,
            ),
        ):
            if value < best_cost:
                best, best_cost = candidate, value
    stopped_by = "seconds" if time.monotonic() > deadline else "stagnation"
    trajectory = trajectory_of(best, problem)
    return Design(trajectory, quality(trajectory, settings, geometry), settings, stopped_by)
