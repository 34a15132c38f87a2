"""Rival causes: those between which an experiment is to decide."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.verdict import read
from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.candidates.columns import torque_columns
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.diagnosis.detectability.directions import bend, direction_of, orthonormal
from pipelines.diagnosis.detectability.shapes import shapes_of
from pipelines.effects import Effect
from pipelines.errors import InputError, about
from pipelines.mechanics.machine import Machine
from pipelines.model import Term, term_from
from pipelines.wording.label import cause_at

SETTING = "--separate"


@dataclass(frozen=True)
class Rival:
    """A cause, how probable it is before the experiment, and what a diagnosis fitted."""

    effect: Effect
    probability: float
    """Of the rivals together one."""
    term: Term | None = None
    """As a diagnosis fitted it."""

    @property
    def label(self) -> str:
        """``effect@joint``."""
        return self.effect.label


@dataclass(frozen=True)
class SizedRival:
    """A rival with the shapes and amplitudes that it may have."""

    rival: Rival
    truths: tuple[tuple[Candidate, float], ...]
    """Shapes and amplitudes that are equally probable if it is the true cause. The amplitude is 1
    at the size of a shape that transforms the motion."""
    shapes: tuple[Candidate, ...]
    """All shapes with which it could explain another cause."""


@dataclass(frozen=True)
class Appearance:
    """How a rival of one shape looks in the rows of a detection problem."""

    torque: NDArray
    """(rows,) at amplitude 1, without what the baseline explains, in units of the noise."""
    span: NDArray
    """(rows, k) orthonormal: all that its amplitudes can explain."""

    @classmethod
    def of(cls, candidate: Candidate, problem: DetectionProblem) -> "Appearance":
        """Compute it for a rival's shape in planned or recorded runs."""
        torque = unit_torque(candidate, problem)
        if candidate.transforms_motion:
            return cls(torque, orthonormal(torque[:, np.newaxis]))
        own = candidate.columns_in([run.motion.run for run in problem.runs])
        columns = enumerate(_columns(candidate, problem))
        return cls(torque, orthonormal(problem.remainder([own.expand(c, r) for r, c in columns])))


def unit_torque(candidate: Candidate, problem: DetectionProblem) -> NDArray:
    """Return a candidate's torque at amplitude 1 in the rows of a problem, (rows,).

    Without what the baseline explains, in units of the noise.
    """
    return problem.remainder(_direction(candidate, problem))[:, 0]


def _direction(candidate: Candidate, problem: DetectionProblem) -> list[NDArray]:
    """Return the torque at amplitude 1, (m, O, 1) of each run."""
    if candidate.transforms_motion:
        return bend(candidate, problem)
    return direction_of(candidate.effect, _columns(candidate, problem), problem)


def _columns(candidate: Candidate, problem: DetectionProblem) -> list[NDArray]:
    return [torque_columns(candidate, r, run) for r, run in enumerate(problem.runs)]


def rivals_named(labels: Sequence[str], machine: Machine) -> list[Rival]:
    """Return equally probable rivals.

    Parameters
    ----------
    labels : sequence of str
        ``effect@joint``, or ``effect`` of a whole machine.
    machine : Machine
        That has them.

    Raises
    ------
    InputError
        Where there are fewer than two, one twice, or one that the machine cannot have.
    """
    if len(labels) < 2 or len(set(labels)) < len(labels):
        raise InputError(
            f"{SETTING}: found {', '.join(labels) or 'no cause'}, expected two different causes or"
            " more, each as EFFECT@JOINT; `exoid effects` lists them"
        )
    effects = [cause_at(label, machine, SETTING) for label in labels]
    return [Rival(effect, 1.0 / len(effects)) for effect in effects]


def rivals_in_verdict(folder: Path, machine: Machine) -> list[Rival]:
    """Return the causes between which a diagnosis did not decide, with its probabilities.

    Parameters
    ----------
    folder : Path
        What ``exoid diagnose`` wrote.
    machine : Machine
        That was diagnosed.

    Raises
    ------
    InputError
        Where it leaves no choice of causes.
    ContractError
        Where the verdict is damaged.
    """
    verdict = read(folder / "verdict.json")
    choices = ([one for one in f.causes if not one.dropped] for f in verdict.findings)
    open_ones = next((causes for causes in choices if len(causes) > 1), None)
    if open_ones is None:
        raise InputError(
            f"{folder}: its verdict leaves no choice of causes, which a motion could decide;"
            f" `exoid design {SETTING}` takes any causes"
        )
    total = sum(one.probability for one in open_ones)
    # Values that differ from run to run are no value of the next one.
    fitted = {
        cause.label: {p.name: p.value for p in cause.parameters}
        for cause in verdict.causes
        if not cause.per_run
    }
    rivals = []
    for one in open_ones:
        effect = cause_at(one.label, machine, str(folder))
        values = fitted.get(one.label)
        with about(folder / "verdict.json"):
            term = term_from(effect, values) if values else None
        rivals.append(Rival(term.effect if term else effect, one.probability / total, term))
    return rivals


def sized(rivals: Sequence[Rival], problem: DetectionProblem) -> list[SizedRival]:
    """Return rivals with the shapes and amplitudes that agree with what is known.

    Runs that did not separate causes showed one torque, which each of them would have made. Where
    a diagnosis fitted none, it is a usual share of the joint's torque.

    Parameters
    ----------
    rivals : sequence of Rival
    problem : DetectionProblem
        Runs with the last excitation, or a usual one.

    Raises
    ------
    InputError
        Where such runs cannot show a rival.
    """
    motions = [run.motion for run in problem.runs]
    for rival in rivals:
        if not rival.effect.shows_in(motions):
            raise InputError(
                f"{rival.label} cannot show in planned runs, which have no temperatures; give"
                f" `exoid design {SETTING}` the other causes"
            )
    fitted = next((_length(rival.term, problem) for rival in rivals if rival.term), None)
    result = [_sized(rival, problem, fitted) for rival in rivals]
    for one in result:
        if not one.truths:
            raise InputError(
                f"{one.rival.label} makes no torque with the last excitation; give `exoid design"
                f" {SETTING}` the other causes, or that run a wider motion"
            )
    return result


def _length(term: Term, problem: DetectionProblem) -> float:
    """Return the length of a fitted term's torque in the rows of a problem."""
    candidate = _candidate(term, problem)
    if candidate.transforms_motion:
        return float(np.linalg.norm(unit_torque(candidate, problem)))
    torque = [c @ term.linear[:, np.newaxis] for c in _columns(candidate, problem)]
    return float(np.linalg.norm(problem.remainder(torque)))


def _candidate(term: Term, problem: DetectionProblem) -> Candidate:
    return Candidate(term.effect, (tuple(term.shape.tolist()),) * len(problem.runs))


def _sized(rival: Rival, problem: DetectionProblem, fitted: float | None) -> SizedRival:
    grid = list(shapes_of(rival.effect, problem.runs))
    own = grid
    if rival.term is not None:
        own = [_candidate(rival.term, problem)]
        grid = [*own, *grid]
    truths = ((candidate, _amplitude(candidate, problem, fitted)) for candidate in own)
    # A shape that these runs do not show has no amplitude.
    return SizedRival(rival, tuple(one for one in truths if np.isfinite(one[1])), tuple(grid))


def _amplitude(candidate: Candidate, problem: DetectionProblem, fitted: float | None) -> float:
    """Return the amplitude at which a candidate makes the fitted torque, or a usual one."""
    if fitted is not None:
        length = float(np.linalg.norm(unit_torque(candidate, problem)))
        return fitted / length if length > 0.0 else np.inf
    effect, share = candidate.effect, float(np.mean(CRITERIA.amplitudes))
    rms = problem.rms(effect, _direction(candidate, problem))
    return share * float(problem.torque_rms[problem.joint(effect)]) / rms if rms > 0.0 else np.inf
