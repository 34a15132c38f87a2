"""Which experiment would end the doubt of a verdict, and how probably."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipelines.design.search import Report
from pipelines.errors import NotIdentifiable
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import Rival
from pipelines.investigation.separating_design import (
    SeparatingDesign,
    separating_design,
    separation,
    separation_of_last,
)
from pipelines.investigation.separation import DECIDED, Separation, decided
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
    rivals: Sequence[Rival],
    runs: PlannedRuns,
    geometry: Geometry,
    last: Trajectory,
    report: Report = lambda done, note: None,
) -> NextExperiments:
    """Compare the experiments that could decide between rivals.

    Parameters
    ----------
    rivals : sequence of Rival
        Two or more, with the probabilities of a verdict.
    runs : PlannedRuns
        As those of the verdict.
    geometry : Geometry
        Lengths and gravity.
    last : Trajectory
        The excitation that did not separate them.
    report : callable, optional
        Called with the share that is done, 0 to 1, and a note.
    """
    again = separation_of_last(rivals, runs, last)
    experiments = [NextExperiment("repeat", "record the same motion again", _decides(again))]
    design: SeparatingDesign | None = None
    words, decides = "record another motion, which separates the causes best", 0.0
    try:
        design = separating_design(again, runs, geometry, report)
        decides = _decides(design.separation)
    except NotIdentifiable:
        words = "no motion within [design.bounds] separates two of them"
    experiments.append(NextExperiment("motion", words, decides))
    for kind in {"exo_alone", "with_human"} - set(runs.kinds):
        other = separation(again.rivals, replace(runs, kinds=(kind,)), last)
        experiments.append(NextExperiment("run", f"record {kind} runs, too", _decides(other)))
    for rival in rivals:
        decides = _decides_by_hand(rival, rivals)
        experiments.append(NextExperiment("test", rival.effect.confirm, decides))
    # Of equal ones the first is the least work.
    ordered = sorted(experiments, key=lambda one: -round(one.decides, 2))
    return NextExperiments(tuple(rivals), tuple(ordered), design)


def _decides(separated: Separation) -> float:
    """Return the probability that an experiment decides for the true cause, over all truths."""
    prior = np.array([one.rival.probability for one in separated.rivals])
    return float(prior @ decided(separated.posterior()))


def _decides_by_hand(rival: Rival, rivals: Sequence[Rival]) -> float:
    """Return the probability that a test which shows whether one cause is there decides."""
    others = [one.probability for one in rivals if one is not rival]
    without = sum(others)
    leaves_one = without > 0.0 and max(others) >= DECIDED * without
    return rival.probability + (without if leaves_one else 0.0)
