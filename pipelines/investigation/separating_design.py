"""Search the excitation that separates rival causes best.

The expected log odds of the worst pair are maximized under the bounds of every excitation. Motions
are repaired as in any other search. One takes milliseconds instead of microseconds, so that the
swarm does not fly: its best particles are polished.
"""

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.design.evolution import polish
from pipelines.design.fitness import costs
from pipelines.design.search import Report, first_swarm, search_problem, spread_of, trajectory_of
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import Rival
from pipelines.investigation.separation import Separation
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry


def separating_excitation(
    rivals: Sequence[Rival],
    runs: PlannedRuns,
    geometry: Geometry,
    report: Report = lambda done, note: None,
) -> tuple[FourierTrajectory, str]:
    """Search for the excitation that separates rivals best and keeps its bounds at every time.

    Parameters
    ----------
    rivals : sequence of Rival
        Two or more.
    runs : PlannedRuns
        With the settings of the search.
    geometry : Geometry
        Lengths and gravity.
    report : callable
        Called with the share done, 0 to 1, and the best value so far.

    Returns
    -------
    trajectory : FourierTrajectory
        The best excitation.
    stopped_by : str
        ``stagnation``, or ``seconds``; then the result depends on the computer's speed.
    """
    polished, patience, least_gain = 2, 10, 1e-3
    settings = runs.settings
    rng = np.random.default_rng(settings.seed)
    problem = search_problem(settings, geometry, samples=200, samples_per_harmonic=40)
    spread = spread_of(problem)
    deadline = time.monotonic() + settings.seconds
    best_odds, done = -np.inf, 0.0

    def costs_of(candidates: NDArray) -> NDArray:
        nonlocal best_odds
        costs(candidates, problem)  # repairs them
        found = [separation(rivals, runs, trajectory_of(one, problem)) for one in candidates]
        best_odds = max(best_odds, *(one.least() for one in found))
        report(done, f"log odds {best_odds:.3g}")
        return np.array([_cost(one) for one in found])

    swarm = first_swarm(settings, problem, spread, rng)
    first = costs_of(swarm.position)
    best, best_cost = swarm.position[np.argmin(first)], float(first.min())
    for number, start in enumerate(np.argsort(first)[:polished]):
        done = (1 + number) / (1 + polished)
        candidate, cost = polish(
            swarm.position[start],
            0.1 * spread,
            costs_of,
            rng,
            out_of_time=lambda: time.monotonic() > deadline,
            patience=patience,
            least_gain=least_gain,
        )
        if cost < best_cost:
            best, best_cost = candidate, cost
    stopped_by = "seconds" if time.monotonic() > deadline else "stagnation"
    return trajectory_of(best, problem), stopped_by


def separation(
    rivals: Sequence[Rival], runs: PlannedRuns, trajectory: FourierTrajectory
) -> Separation:
    """Return how well the runs with a trajectory separate rivals."""
    return Separation.of(rivals, runs.problem(trajectory, rivals))


def _cost(found: Separation) -> float:
    """Return what the search minimizes: the worst pair's log odds, turned round.

    A pair that no motion changes leaves the search to the others.
    """
    others = 1e-3
    return -found.least() - others * float(found.log_odds().mean())
