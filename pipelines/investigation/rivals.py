"""Rival causes: those between which an experiment is to decide."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pipelines.diagnosis.candidates.columns import torque_columns
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.diagnosis.detectability.directions import bend, direction_of, orthonormal
from pipelines.diagnosis.detectability.shapes import shapes_of
from pipelines.effects import Effect
from pipelines.errors import InputError
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.motion import Motion
from pipelines.model import BASELINE
from pipelines.wording.label import effect_at

SETTING = "--separate"


@dataclass(frozen=True)
class Rival:
    """A cause, and how probable and how large it is before the experiment."""

    effect: Effect
    probability: float
    """Of the rivals together one."""
    size: float
    """Of its first amplitude, in that unit; a shape that transforms the motion has its own size."""

    @property
    def label(self) -> str:
        """``effect@joint``."""
        return self.effect.label


@dataclass(frozen=True)
class Appearance:
    """How a rival of one shape looks in the rows of a detection problem."""

    torque: np.ndarray
    """(rows,) at its size, without what the baseline explains, in units of the noise."""
    span: np.ndarray
    """(rows, k) orthonormal: all that its amplitudes can explain."""


def rivals_of(labels: Sequence[str], machine: Machine) -> list[Rival]:
    """Return equally probable rivals of a usual size.

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
            " more, such as parallel_spring@knee rotor_inertia@knee"
        )
    effects = [
        effect_at(label, machine, lambda one: one.name not in BASELINE, SETTING) for label in labels
    ]
    return [Rival(effect, 1.0 / len(effects), usual_size(effect)) for effect in effects]


def usual_size(effect: Effect) -> float:
    """Return the middle of the typical range of an effect's first amplitude; 1 without one."""
    if not effect.linear:
        return 1.0
    low, high = np.sort(np.abs(effect.linear[0].typical))
    # A range of both signs, or from zero on, has no smallest size.
    return float(
        0.5 * high if low == 0.0 or effect.linear[0].typical[0] < 0.0 else np.sqrt(low * high)
    )


def refuse_hidden(rivals: Sequence[Rival], motions: Sequence[Motion]) -> None:
    """Refuse rivals that no planned run can show.

    Raises
    ------
    InputError
        Names the first one.
    """
    for rival in rivals:
        if not rival.effect.shows_in(motions):
            runs = ", ".join(motion.run for motion in motions)
            raise InputError(
                f"{SETTING}: {rival.label} cannot show in planned runs ({runs}), which have no cuff"
                " forces and no temperatures; leave it out"
            )


def appearances(rival: Rival, problem: DetectionProblem) -> Iterator[Appearance]:
    """Yield how a rival looks at each of the shapes that stand for all it may have.

    Parameters
    ----------
    rival : Rival
    problem : DetectionProblem
        Planned or recorded runs.
    """
    runs = problem.runs
    for candidate in shapes_of(rival.effect, runs):
        if candidate.transforms_motion:
            torque = problem.remainder(bend(candidate, problem))
            yield Appearance(torque[:, 0], orthonormal(torque))
            continue
        columns = [torque_columns(candidate, r, run) for r, run in enumerate(runs)]
        own = candidate.columns_in([run.motion.run for run in runs])
        span = problem.remainder([own.expand(column, r) for r, column in enumerate(columns)])
        unit = problem.remainder(direction_of(rival.effect, columns, problem))
        yield Appearance(rival.size * unit[:, 0], orthonormal(span))
