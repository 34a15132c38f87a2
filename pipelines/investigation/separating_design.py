"""The excitation that separates rival causes best.

The expected log odds of the worst pair are maximized, up to the value from which the pair is
decided in nearly every experiment. From there on the parameters count, by log det.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipelines.design.excitation import Design
from pipelines.design.search import Report
from pipelines.errors import NotIdentifiable
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.polished_search import polished_search
from pipelines.investigation.rivals import Rival, SizedRival, sized
from pipelines.investigation.separation import Separation
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
    design = _search(before.rivals, runs, geometry, report)
    return SeparatingDesign(design, separation(before.rivals, runs, design.trajectory), before)


def separation_of_last(rivals: Sequence[Rival], runs: PlannedRuns, last: Trajectory) -> Separation:
    """Return how well the runs with the last excitation separate rivals, which it sizes.

    Raises
    ------
    InputError
        Where such runs cannot show a rival.
    """
    problem = runs.problem(last, [one.effect for one in rivals])
    return Separation.of(sized(rivals, problem), problem)


def separation(
    rivals: Sequence[SizedRival], runs: PlannedRuns, trajectory: Trajectory
) -> Separation:
    """Return how well the runs with a trajectory separate rivals."""
    effects = [sized.rival.effect for sized in rivals]
    return Separation.of(rivals, runs.problem(trajectory, effects))


def _search(
    rivals: Sequence[SizedRival], runs: PlannedRuns, geometry: Geometry, report: Report
) -> Design:
    """Return the excitation of the largest expected log odds."""
    best_odds = -np.inf

    def cost(trajectory: Trajectory, log_det: float) -> tuple[float, str]:
        nonlocal best_odds
        separated = separation(rivals, runs, trajectory)
        best_odds = max(best_odds, separated.least())
        return _cost(separated, log_det), f"log odds {best_odds:.3g}"

    def refuse_inseparable(start: Trajectory) -> None:
        if inseparable := separation(rivals, runs, start).inseparable():
            one, other = inseparable[0]
            raise NotIdentifiable(
                f"no motion within [design.bounds] separates {one} and {other}: each makes the"
                " torque of the other. Leave one out; another sensor or a test by hand may decide"
            )

    return polished_search(runs.settings, geometry, cost, report, refuse_inseparable)


def _cost(separated: Separation, log_det: float) -> float:
    """Return what the search minimizes."""
    # A pair that no motion changes leaves the search to the others. A tenth of a log odds is worth
    # one of log det.
    of_others, of_parameters = 1e-3, 0.1
    odds = np.minimum(separated.log_odds(), SURELY_DECIDED)
    worst = odds[~np.eye(len(odds), dtype=bool)].min()
    return -float(worst + of_others * odds.mean() + of_parameters * log_det)
