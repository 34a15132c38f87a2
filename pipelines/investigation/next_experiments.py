"""Which experiment would end the doubt of a verdict, and how probably."""

from collections.abc import Sequence
from dataclasses import dataclass

from pipelines.design.search import Report
from pipelines.errors import NotIdentifiable
from pipelines.investigation.doubt import DECIDED
from pipelines.investigation.rivals import Rival
from pipelines.investigation.separating_design import SeparatingDesign, separating_design
from pipelines.investigation.separation_problem import SeparationProblem
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.trajectory import Trajectory


@dataclass(frozen=True)
class NextExperiment:
    """An experiment, and what it is expected to do."""

    what: str
    """``motion``, ``repeat``, ``run`` or ``test``."""
    words: str
    decides: float
    """Probability that the true cause has at least ``DECIDED`` afterwards."""


@dataclass(frozen=True)
class NextExperiments:
    """The experiments that could decide between rivals, the best first."""

    rivals: tuple[Rival, ...]
    experiments: tuple[NextExperiment, ...]
    design: SeparatingDesign | None
    """The excitation of the motion; None where no motion separates them."""


def next_experiments(
    problem: SeparationProblem,
    geometry: Geometry,
    last: Trajectory,
    report: Report = lambda done, note: None,
) -> NextExperiments:
    """Compare the experiments that could decide between rivals.

    Parameters
    ----------
    problem : SeparationProblem
        Two rivals or more with the probabilities of a verdict, and runs as it had.
    geometry : Geometry
        Lengths and gravity.
    last : Trajectory
        The excitation that did not separate them.
    report : callable, optional
        Called with the share that is done, 0 to 1, and a note.
    """
    rivals = [sized.rival for sized in problem.rivals]
    again = problem.with_motion(last)
    experiments = [NextExperiment("repeat", "record the same motion again", again.decides())]
    design: SeparatingDesign | None = None
    words, decides = "record another motion, which separates the causes best", 0.0
    try:
        design = separating_design(problem, geometry, last, report)
        decides = design.separation.decides()
        words += "".join(f"; none separates {one} and {other}" for one, other in design.inseparable)
    except NotIdentifiable:
        words = "no motion within [design.bounds] separates them"
    experiments.append(NextExperiment("motion", words, decides))
    for kind in {"exo_alone", "with_human"} - set(problem.runs.kinds):
        other = problem.with_motion(last, (kind,))
        experiments.append(NextExperiment("run", f"record {kind} runs, too", other.decides()))
    for rival in rivals:
        if rival.effect:
            decides = _decides_by_hand(rival, rivals)
            experiments.append(NextExperiment("test", rival.effect.confirm, decides))
    # Of equal ones the first is the least work.
    ordered = sorted(experiments, key=lambda one: -round(one.decides, 2))
    return NextExperiments(tuple(rivals), tuple(ordered), design)


def _decides_by_hand(rival: Rival, rivals: Sequence[Rival]) -> float:
    """Return the probability that a test which shows whether one cause is there decides."""
    others = [one.probability for one in rivals if one is not rival]
    without = sum(others)
    leaves_one = without > 0.0 and max(others) >= DECIDED * without
    return rival.probability + (without if leaves_one else 0.0)
