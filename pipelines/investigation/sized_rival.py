"""Rivals with the sizes that agree with what is known, and how they look in some runs.

Runs that did not separate causes showed one torque: each cause has the amplitudes with which it
comes closest to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.diagnosis.detectability.directions import orthonormal, parts_of, unit_torque
from pipelines.diagnosis.detectability.shapes import shapes_of
from pipelines.diagnosis.selection.prior import FEATURES, weights
from pipelines.errors import InputError
from pipelines.investigation.rivals import SETTING, Rival, effects_of
from pipelines.model import Term


@dataclass(frozen=True)
class Truth:
    """A cause of one shape and size."""

    candidate: Candidate
    factor: float
    """Of the torque at ``linear``; 1 at the size of a shape that transforms the motion."""
    linear: NDArray | None = None
    """(k,) amplitudes; None for a first amplitude of 1, with others that suit it."""

    def torque(self, problem: DetectionProblem, parts: list[NDArray] | None = None) -> NDArray:
        """Return its torque in the rows of a problem, (rows,).

        Without what the baseline explains, in units of the noise. ``parts`` are those of its
        candidate, if they are known: ``parts_of``.
        """
        parts = parts_of(self.candidate, problem) if parts is None else parts
        if self.linear is None:
            torque = unit_torque(self.candidate, parts, problem)
        else:
            torque = [c @ self.linear[:, np.newaxis] for c in parts]
        return self.factor * problem.remainder(torque)[:, 0]


@dataclass(frozen=True)
class SizedRival:
    """A rival with the shapes and sizes that it may have; nothing has none."""

    rival: Rival
    truths: tuple[Truth, ...]
    """Equally probable if it is the true cause."""
    shapes: tuple[Candidate, ...]
    """All shapes with which it could explain another cause."""


@dataclass(frozen=True)
class Appearance:
    """What a cause of one shape can explain in the rows of a detection problem."""

    span: NDArray
    """(rows, k) orthonormal: all that its amplitudes can explain."""
    log_size: float = 0.0
    """Half the log determinant of the Gram matrix of its columns: how well amplitudes are known."""

    @classmethod
    def of(
        cls, candidate: Candidate, parts: list[NDArray], problem: DetectionProblem
    ) -> "Appearance":
        """Compute it for a shape and its parts, (m, O, k) of each planned or recorded run."""
        if not candidate.transforms_motion:
            own = candidate.columns_in([run.motion.run for run in problem.runs])
            parts = [own.expand(c, r) for r, c in enumerate(parts)]
        columns = problem.whitened(problem.remainder(parts))
        span = orthonormal(columns)
        sizes = np.linalg.svd(span.T @ columns, compute_uv=False)
        # An amplitude that does not show is not known at all, and has no size.
        return cls(span, float(np.log(sizes[sizes > 0.0]).sum()))


def sized(rivals: Sequence[Rival], problem: DetectionProblem) -> list[SizedRival]:
    """Return rivals with the shapes and sizes that agree with what is known.

    Where nothing is a rival, the torque that runs showed is at most as large as its probability
    allows. Where a diagnosis fitted no rival, a cause makes a usual share of the joint's torque.

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
    for effect in effects_of(rivals):
        if not effect.shows_in(motions):
            raise InputError(
                f"{effect.label} cannot show in planned runs, which have no temperatures; give"
                f" `exoid design {SETTING}` the other causes"
            )
    nothing = sum(rival.probability for rival in rivals if rival.effect is None)
    nothing /= sum(rival.probability for rival in rivals)
    length = _seen_length(nothing, problem) if nothing > 0.0 else None
    seen = _seen(rivals, length, problem)
    return [_sized(rival, seen, length, problem) for rival in rivals]


def _seen(
    rivals: Sequence[Rival], length: float | None, problem: DetectionProblem
) -> NDArray | None:
    """Return the torque that runs showed, (rows,), at most so long; None without a fitted rival."""
    term = next((rival.term for rival in rivals if rival.term), None)
    if term is None:
        return None
    candidate = _candidate(term, problem)
    linear = None if candidate.transforms_motion else term.linear
    seen = Truth(candidate, 1.0, linear).torque(problem)
    size = _length(seen, problem)
    return seen * min(1.0, length / size) if length is not None and size > 0.0 else seen


def _candidate(term: Term, problem: DetectionProblem) -> Candidate:
    return Candidate(term.effect, (tuple(term.shape.tolist()),) * len(problem.runs))


def _length(torque: NDArray, problem: DetectionProblem) -> float:
    """Return the length of a torque (rows,) as it shows against noise and background."""
    return float(np.sqrt(problem.shown(torque)))


def _seen_length(nothing: float, problem: DetectionProblem) -> float:
    """Return the length of a torque after which nothing is still so probable.

    A cause of one amplitude gains half its square, and costs its prior odds and its amplitude.
    """
    price = 0.5 * np.log(problem.independent) - weights(CRITERIA)[FEATURES.index("cause")]
    gain = max(np.log((1.0 - nothing) / nothing) + price, 0.0)
    return float(np.sqrt(2.0 * gain))


def _sized(
    rival: Rival, seen: NDArray | None, length: float | None, problem: DetectionProblem
) -> SizedRival:
    if rival.effect is None:
        return SizedRival(rival, (), ())
    grid = list(shapes_of(rival.effect, problem.runs))
    if rival.term is not None and seen is not None:
        own = _candidate(rival.term, problem)
        truths, grid = _as_seen([own], seen, problem), [own, *grid]
    elif seen is not None:
        truths = _as_seen(grid, seen, problem)
    else:
        # A shape that these runs do not show has no size.
        sizes = ((one, _factor(one, length, problem)) for one in grid)
        truths = [Truth(one, factor) for one, factor in sizes if np.isfinite(factor)]
    if not truths:
        raise InputError(
            f"{rival.label} makes no torque with the last excitation; give `exoid design"
            f" {SETTING}` the other causes, or that run a wider motion"
        )
    return SizedRival(rival, tuple(truths), tuple(grid))


def _as_seen(grid: Sequence[Candidate], seen: NDArray, problem: DetectionProblem) -> list[Truth]:
    """Return the shapes that explain a torque (rows,) about as well as the best one does."""
    # Log likelihood by which a shape may be worse: the others have an eighth of its probability.
    tolerance = 2.0
    truths, explained = list[list[Truth]](), list[float]()
    shown = problem.whitened(seen)
    for candidate in grid:
        columns = problem.whitened(problem.remainder(parts_of(candidate, problem)))
        gram = columns.T @ columns + np.diag(1.0 / _typical(candidate) ** 2)
        if not columns.any():
            continue
        linear = np.linalg.solve(gram, columns.T @ shown)
        explained.append(0.5 * float(shown @ columns @ linear))
        truths.append(_around(candidate, linear, np.linalg.inv(gram)))
    best = max(explained, default=0.0)
    pairs = zip(truths, explained, strict=True)
    return [one for own, gain in pairs if gain >= best - tolerance for one in own]


def _typical(candidate: Candidate) -> NDArray:
    """Return a standard deviation of each amplitude before any data, (k,); two are typical."""
    if candidate.transforms_motion:
        return np.ones(1)  # of the size at which the shape is
    return np.array([0.5 * np.max(np.abs(p.typical)) for p in candidate.effect.linear])


def _around(candidate: Candidate, linear: NDArray, covariance: NDArray) -> list[Truth]:
    """Return a candidate at the 2 k cubature points of its amplitudes' distribution.

    They have its mean and covariance: amplitudes are only as well known as the runs show them.
    """
    variances, axes = np.linalg.eigh(covariance)
    steps = axes * np.sqrt(len(linear) * np.maximum(variances, 0.0))
    return [Truth(candidate, 1.0, linear + sign * step) for step in steps.T for sign in (1.0, -1.0)]


def _factor(candidate: Candidate, length: float | None, problem: DetectionProblem) -> float:
    """Return the factor at which a candidate's torque is so long, or has a usual size."""
    direction = unit_torque(candidate, parts_of(candidate, problem), problem)
    if length is not None:
        unit = _length(problem.remainder(direction)[:, 0], problem)
        return length / unit if unit > 0.0 else np.inf
    effect, share = candidate.effect, float(np.mean(CRITERIA.amplitudes))
    rms = problem.rms(effect, direction)
    return share * float(problem.torque_rms[problem.joint(effect)]) / rms if rms > 0.0 else np.inf
