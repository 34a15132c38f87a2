"""The excitation that separates rival causes best.

The expected log loss of the posterior is minimized: the pair that is worst separated counts most,
and one that is decided, or that no motion separates, no longer.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipelines.design.excitation import Design
from pipelines.design.search import Report
from pipelines.errors import NotIdentifiable
from pipelines.investigation.polished_search import polished_search
from pipelines.investigation.separation import Pair, Separation
from pipelines.investigation.separation_problem import SeparationProblem
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.trajectory import Trajectory

OF_PARAMETERS = 1e-3
"""Log loss that one of log det is worth: where causes are decided, the parameters count."""


@dataclass(frozen=True)
class SeparatingDesign:
    """A designed excitation, and how well it separates rivals."""

    design: Design
    separation: Separation
    before: Separation
    """The same for the last excitation."""
    inseparable: tuple[Pair, ...]
    """Pairs of rivals that no motion separates."""

    @property
    def least(self) -> float:
        """The least of the expected log odds, of the pairs that this motion separates."""
        return self.separation.least(self.separation.separable())

    def metadata(self) -> dict[str, Any]:
        """Return the metadata of the excitation's file."""
        return self.design.metadata() | {
            "criterion": "separation",
            "criterion_value": self.least,
            "decides": self.separation.decides(),
            "separation": self.separation.as_json(),
            "separation_before": self.before.as_json(),
            "inseparable": [list(pair) for pair in self.inseparable],
        }


def separating_design(
    problem: SeparationProblem,
    geometry: Geometry,
    last: Trajectory,
    report: Report = lambda done, note: None,
) -> SeparatingDesign:
    """Design the excitation that separates rivals best.

    Equal settings give an equal excitation, unless ``seconds`` ended the search. Pairs that no
    motion separates are left to other experiments, and do not count.

    Parameters
    ----------
    problem : SeparationProblem
        Rivals, and runs with the settings of the search.
    geometry : Geometry
        Lengths and gravity.
    last : Trajectory
        The excitation that did not separate them, or a usual one.
    report : callable, optional
        Called with the share that is done, 0 to 1, and a note.

    Raises
    ------
    NotIdentifiable
        Where no motion within the bounds separates any two of them.
    """
    least_loss, inseparable = np.inf, list[Pair]()

    def cost(motion: Trajectory, log_det: float) -> tuple[float, str]:
        nonlocal least_loss
        loss = problem.with_motion(motion).log_loss()
        least_loss = min(least_loss, loss)
        return loss - OF_PARAMETERS * log_det, f"log loss {least_loss:.3g}"

    def refuse_inseparable(motion: Trajectory) -> None:
        separated = problem.with_motion(motion)
        inseparable.extend(separated.inseparable())
        if not separated.separable().any():
            one, other = inseparable[0]
            raise NotIdentifiable(
                f"no motion within [design.bounds] separates {one} and {other}: each makes the"
                " torque of the other; another sensor or a test by hand may decide"
            )

    settings = problem.runs.settings
    design = polished_search(settings, geometry, cost, report, refuse_inseparable, last)
    separated, before = problem.with_motion(design.trajectory), problem.with_motion(last)
    return SeparatingDesign(design, separated, before, tuple(inseparable))
