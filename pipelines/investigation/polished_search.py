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
from pipelines.design.search import Report, first_swarm, search_problem, spread_of, trajectory_of
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
    check: Callable[[Trajectory], None] = lambda start: None,
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
        May refuse the best motion of the first swarm.
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
    start = swarm.position[np.argmin(costs_of(swarm.position))]
    check(trajectory_of(start, problem))
    done = 0.5
    best, _ = polish(
        start,
        0.1 * spread,
        costs_of,
        rng,
        out_of_time=lambda: time.monotonic() > deadline,
        patience=patience,
        least_gain=least_gain,
    )
    stopped_by = "seconds" if time.monotonic() > deadline else "stagnation"
    trajectory = trajectory_of(best, problem)
    return Design(trajectory, quality(trajectory, settings, geometry), settings, stopped_by)
