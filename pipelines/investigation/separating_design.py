"""The excitation that separates rival causes best.

The expected log odds of the worst pair are maximized, up to the value from which the pair is
decided in nearly every experiment. From there on the parameters count, by log det. Motions are
repaired as in any other search. One takes milliseconds instead of microseconds, so that the swarm
does not fly: its best particle is polished.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.design.evolution import polish
from pipelines.design.excitation import Design
from pipelines.design.fitness import costs
from pipelines.design.quality import quality
from pipelines.design.search import Report, first_swarm, search_problem, spread_of, trajectory_of
from pipelines.errors import NotIdentifiable
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import Rival, SizedRival, sized
from pipelines.investigation.separation import Separation
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.trajectory import Trajectory

SURELY_DECIDED = 23.5
"""Expected log odds m from which all but one in a thousand experiments decide: their standard
deviation is the root of 2 m, and m less three of it is the log odds of ``DECIDED``."""


@dataclass(frozen=True)
class SeparatingDesign:
    """A designed excitation, and how well it separates rivals."""

    design: Design
    separation: Separation
    before: Separation
    """The same for the last excitation."""

    def metadata(self) -> dict[str, Any]:
        """Return the metadata of the excitation's file."""
        return self.design.metadata() | {
            "criterion": "separation",
            "criterion_value": self.separation.least(),
            "separation": self.separation.as_json(),
            "separation_before": self.before.as_json(),
        }


def separating_design(
    before: Separation,
    runs: PlannedRuns,
    geometry: Geometry,
    report: Report = lambda done, note: None,
) -> SeparatingDesign:
    """Design the excitation that separates rivals best.

    Equal settings give an equal excitation, unless ``seconds`` ended the search.

    Parameters
    ----------
    before : Separation
        Of the excitation that did not separate them, or a usual one.
    runs : PlannedRuns
        With the settings of the search.
    geometry : Geometry
        Lengths and gravity.
    report : callable, optional
        Called with the share that is done, 0 to 1, and a note.

    Raises
    ------
    NotIdentifiable
        Where no motion within the bounds separates two of them.
    """
    trajectory, stopped_by = _search(before.rivals, runs, geometry, report)
    settings = runs.settings
    design = Design(trajectory, quality(trajectory, settings, geometry), settings, stopped_by)
    return SeparatingDesign(design, separation(before.rivals, runs, trajectory), before)


def separation_of_last(rivals: Sequence[Rival], runs: PlannedRuns, last: Trajectory) -> Separation:
    """Return how well the runs with the last excitation separate rivals, which it sizes.

    Raises
    ------
    InputError
        Where such runs cannot show a rival.
    """
    problem = runs.problem(last, rivals)
    return Separation.of(sized(rivals, problem), problem)


def separation(
    rivals: Sequence[SizedRival], runs: PlannedRuns, trajectory: Trajectory
) -> Separation:
    """Return how well the runs with a trajectory separate rivals."""
    return Separation.of(rivals, runs.problem(trajectory, [sized.rival for sized in rivals]))


def _search(
    rivals: Sequence[SizedRival], runs: PlannedRuns, geometry: Geometry, report: Report
) -> tuple[FourierTrajectory, str]:
    """Return the best excitation, and ``stagnation`` or ``seconds`` for what ended the search."""
    patience, least_gain = 12, 3e-4
    settings = runs.settings
    rng = np.random.default_rng(settings.seed)
    by_log_det = settings.model_copy(update={"criterion": "log_det"})
    problem = search_problem(by_log_det, geometry, samples=200, samples_per_harmonic=40)
    spread = spread_of(problem)
    deadline = time.monotonic() + settings.seconds
    best_odds, done = -np.inf, 0.0

    def costs_of(candidates: NDArray) -> NDArray:
        nonlocal best_odds
        log_det = -costs(candidates, problem)  # repairs them
        separations = [separation(rivals, runs, trajectory_of(one, problem)) for one in candidates]
        best_odds = max(best_odds, *(one.least() for one in separations))
        report(done, f"log odds {best_odds:.3g}")
        return np.array([_cost(*one) for one in zip(separations, log_det, strict=True)])

    swarm = first_swarm(settings, problem, spread, rng)
    start = swarm.position[np.argmin(costs_of(swarm.position))]
    if inseparable := separation(rivals, runs, trajectory_of(start, problem)).inseparable():
        one, other = inseparable[0]
        raise NotIdentifiable(
            f"no motion within [design.bounds] separates {one} and {other}: each makes the torque"
            " of the other. Leave one out; another sensor or a test by hand may decide"
        )
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
    return trajectory_of(best, problem), stopped_by


def _cost(separated: Separation, log_det: float) -> float:
    """Return what the search minimizes."""
    # A pair that no motion changes leaves the search to the others. A tenth of a log odds is worth
    # one of log det.
    of_others, of_parameters = 1e-3, 0.1
    odds = np.minimum(separated.log_odds(), SURELY_DECIDED)
    worst = odds[~np.eye(len(odds), dtype=bool)].min()
    return -float(worst + of_others * odds.mean() + of_parameters * log_det)
