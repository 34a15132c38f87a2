"""Which experiment would end the doubt of a verdict, and how probably."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from pipelines.design.search import Report
from pipelines.errors import NotIdentifiable
from pipelines.investigation.doubt import DECIDED
from pipelines.investigation.rivals import Rival, effects_of
from pipelines.investigation.sensors import sensors_for
from pipelines.investigation.separating_design import SeparatingDesign, separating_design
from pipelines.investigation.separation_problem import SeparationProblem
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.trajectory import Trajectory


@dataclass(frozen=True)
class NextExperiment:
    """An experiment, and what it is expected to do."""

    what: str
    """``motion``, ``repeat``, ``run``, ``test`` or ``sensor``."""
    words: str
    decides: float
    """Probability that the true cause is a rival, and has at least ``DECIDED`` afterwards."""


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
    machine = next(one.on for one in effects_of(rivals))
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
    for kind in sorted({"exo_alone", "with_human"} - set(problem.runs.kinds)):
        other = problem.with_motion(last, (kind,))
        experiments.append(NextExperiment("run", f"record {kind} runs, too", other.decides()))
    experiments += [*_tests(rivals), *_sensors(rivals, machine)]
    # Of equal ones the first is the least work.
    ordered = sorted(experiments, key=lambda one: -round(one.decides, 2))
    return NextExperiments(tuple(rivals), tuple(ordered), design)


def _tests(rivals: Sequence[Rival]) -> Iterator[NextExperiment]:
    """Yield the test by hand of each cause, which shows whether it is there."""
    for rival in rivals:
        if rival.effect:
            is_there = [one is rival for one in rivals]
            apart = [[a != b for b in is_there] for a in is_there]
            yield NextExperiment("test", rival.effect.confirm, _decides_by(apart, rivals))


def _sensors(rivals: Sequence[Rival], machine: Machine) -> Iterator[NextExperiment]:
    """Yield the sensors that separate two rivals or more."""
    # Of an unlisted law it is not known where it acts.
    for sensor in sensors_for(machine):
        apart = [
            [
                not (one.law or other.law) and sensor.separates(one.effect, other.effect)
                for other in rivals
            ]
            for one in rivals
        ]
        if any(map(any, apart)):
            yield NextExperiment("sensor", sensor.words, _decides_by(apart, rivals))


def _decides_by(separates: Sequence[Sequence[bool]], rivals: Sequence[Rival]) -> float:
    """Return the probability that an experiment decides, which separates pairs without error."""
    decides = 0.0
    for rival, separated in zip(rivals, separates, strict=True):
        alike = [one for one, apart in zip(rivals, separated, strict=True) if not apart]
        if rival.probability >= DECIDED * sum(one.probability for one in alike):
            decides += rival.probability
    return decides
