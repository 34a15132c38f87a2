"""The excitation that shows causes of wanted sizes.

The cause counts whose wanted size is least, relative to the smallest that a diagnosis would name.
Where all show, the parameters count, by log det.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipelines.design.excitation import Design
from pipelines.design.search import Report
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.errors import InputError
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.polished_search import polished_search
from pipelines.investigation.wanted_sizes import SETTING, SmallestSizes, WantedSize
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.trajectory import Trajectory


@dataclass(frozen=True)
class SizesDesign:
    """A designed excitation, and the smallest sizes that it shows."""

    design: Design
    sizes: SmallestSizes
    before: SmallestSizes
    """The same for the last excitation."""

    def metadata(self) -> dict[str, Any]:
        """Return the metadata of the excitation's file."""
        return self.design.metadata() | {
            "criterion": "sizes",
            "criterion_value": float(self.sizes.shares().min()),
            "sizes": self.sizes.as_json(),
            "sizes_before": self.before.as_json(),
        }


def smallest_sizes(
    wanted: Sequence[WantedSize], runs: PlannedRuns, trajectory: Trajectory
) -> SmallestSizes:
    """Return the smallest sizes of causes that runs with a trajectory show.

    Raises
    ------
    InputError
        Where such runs cannot show one of them at all.
    """
    problem = _problem(wanted, runs, trajectory)
    motions = [run.motion for run in problem.runs]
    for one in wanted:
        if not one.effect.shows_in(motions):
            raise InputError(
                f"{SETTING}: {one.label} cannot show in planned runs, which have no temperatures;"
                " leave it out"
            )
    return SmallestSizes.of(wanted, problem)


def _problem(
    wanted: Sequence[WantedSize], runs: PlannedRuns, trajectory: Trajectory
) -> DetectionProblem:
    return runs.problem(trajectory, [one.effect for one in wanted])


def sizes_design(
    before: SmallestSizes,
    runs: PlannedRuns,
    geometry: Geometry,
    report: Report = lambda done, note: None,
) -> SizesDesign:
    """Design the excitation that shows causes of wanted sizes.

    Equal settings give an equal excitation, unless ``seconds`` ended the search.

    Parameters
    ----------
    before : SmallestSizes
        Of the last excitation, with the wanted sizes.
    runs : PlannedRuns
        With the settings of the search.
    geometry : Geometry
        Lengths and gravity.
    report : callable, optional
        Called with the share that is done, 0 to 1, and a note.
    """
    designs, sizes = [], before
    # The background takes another share in the new motion, for which it is searched again.
    for start in (0.0, 0.5):

        def report_part(done: float, note: str, start: float = start) -> None:
            report(start + 0.5 * done, note)

        design = _search(sizes, runs, geometry, report_part)
        sizes = smallest_sizes(before.wanted, runs, design.trajectory)
        designs.append(SizesDesign(design, sizes, before))
    return max(designs, key=lambda one: float(one.sizes.shares().min()))


def _search(sizes: SmallestSizes, runs: PlannedRuns, geometry: Geometry, report: Report) -> Design:
    """Return the best excitation with the growth of some sizes."""
    best = 0.0

    def cost(trajectory: Trajectory, log_det: float) -> tuple[float, str]:
        nonlocal best
        problem = _problem(sizes.wanted, runs, trajectory)
        shares = SmallestSizes.by_noise(sizes.wanted, problem, sizes.growth).shares()
        best = max(best, float(shares.min()))
        return _cost(shares, log_det), f"least wanted size {best:.3g} of the smallest"

    return polished_search(runs.settings, geometry, cost, report)


def _cost(shares: np.ndarray, log_det: float) -> float:
    """Return what the search minimizes."""
    # A margin for what the plan does not know. A hundredth of a size is worth one of log det, and
    # a cause that no motion shows leaves the search to the others.
    shown, of_others, of_parameters = 1.1, 1e-2, 1e-2
    capped = np.minimum(shares, shown)
    return -float(capped.min() + of_others * capped.mean() + of_parameters * log_det)
