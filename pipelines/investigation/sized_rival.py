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
from pipelines.diagnosis.detectability.directions import parts_of, unit_torque
from pipelines.diagnosis.detectability.shapes import shapes_of
from pipelines.diagnosis.selection.prior import FEATURES, weights
from pipelines.errors import InputError
from pipelines.investigation.law_shape import LawShape
from pipelines.investigation.rivals import SETTING, Rival, effects_of
from pipelines.model import Term
from pipelines.settings.design import JointBounds

Shape = Candidate | LawShape
"""A cause of one shape, or an unlisted law."""


@dataclass(frozen=True)
class Truth:
    """A cause of one shape and size."""

    candidate: Shape
    factor: float
    """Of the torque at ``linear``; 1 at the size of a shape that transforms the motion."""
    linear: NDArray | None = None
    """(k,) amplitudes; None for a first amplitude of 1, with others that suit it."""

    def torque(self, problem: DetectionProblem, parts: list[NDArray] | None = None) -> NDArray:
        """Return its torque in the rows of a problem, (rows,).

        Without what the baseline explains, in units of the noise. ``parts`` are those of its
        candidate, if they are known: ``parts_of``.
        """
        parts = parts_in(problem, self.candidate) if parts is None else parts
        if self.linear is not None:
            torque = [c @ self.linear[:, np.newaxis] for c in parts]
        else:
            assert isinstance(self.candidate, Candidate)  # a law has amplitudes
            torque = unit_torque(self.candidate, parts, problem)
        return self.factor * problem.remainder(torque)[:, 0]


@dataclass(frozen=True)
class SizedRival:
    """A rival with the shapes and sizes that it may have; nothing has none."""

    rival: Rival
    truths: tuple[Truth, ...]
    """Equally probable if it is the true cause."""
    shapes: tuple[Shape, ...]
    """All shapes with which it could explain another cause."""


@dataclass(frozen=True)
class Appearance:
    """What a cause of one shape can explain in the rows of a detection problem."""

    span: NDArray
    """(rows, k) orthonormal: all that its amplitudes can explain."""
    sizes: NDArray
    """(k,) prior standard deviation of the torque along each of them, in units of the noise."""

    @classmethod
    def of(cls, candidate: Shape, parts: list[NDArray], problem: DetectionProblem) -> "Appearance":
        """Compute it for a shape and its parts, (m, O, k) of each planned or recorded run."""
        if isinstance(candidate, LawShape):
            parts = [part * candidate.typical for part in parts]
        else:
            if not candidate.transforms_motion:
                own = candidate.columns_in([run.motion.run for run in problem.runs])
                parts = [own.expand(c, r) for r, c in enumerate(parts)]
            parts = _as_shares(parts, problem)
        columns = problem.whitened(problem.remainder(parts))
        span, sizes, _ = np.linalg.svd(columns, full_matrices=False)
        # What is smaller than rounding is no torque.
        shown = sizes > 1e-8 * sizes.max(initial=0.0)
        return cls(span[:, shown], sizes[shown])

    def explained(self, rows: NDArray) -> NDArray:
        """Return the log likelihood (n,) of some rows (n, rows) where amplitudes are free."""
        return np.asarray(0.5 * np.sum((rows @ self.span) ** 2, axis=1))

    def log_likelihood(self, rows: NDArray) -> NDArray:
        """Return it where amplitudes are integrated out over their prior (Bishop, 2006, eq. 3.86).

        It is one of noise alone.
        """
        squares = self.sizes**2
        known = squares / (1.0 + squares)
        return np.asarray(0.5 * (rows @ self.span) ** 2 @ known - 0.5 * np.log1p(squares).sum())


def _as_shares(parts: list[NDArray], problem: DetectionProblem) -> list[NDArray]:
    """Return orthogonal torques, (m, O, k) of each run, as large as a diagnosis expects a cause.

    Together they are a usual share of a joint's torque, whatever the units of the amplitudes.
    """
    joints = len(problem.torque_rms) // 2
    shares = [
        c[:, :joints] / np.maximum(problem.torque_rms[:joints, np.newaxis], 1e-9) for c in parts
    ]
    rows = np.concatenate(
        [c[r.usable[:, :joints]] for r, c in zip(problem.runs, shares, strict=True)]
    )
    rows = rows[rows.any(axis=1)]
    _, sizes, axes = np.linalg.svd(rows, full_matrices=False)
    shown = sizes > 1e-8 * sizes.max(initial=0.0)
    units = axes[shown].T / sizes[shown] * np.sqrt(len(rows) / max(shown.sum(), 1))
    return [float(np.mean(CRITERIA.amplitudes)) * c @ units for c in parts]


def parts_in(problem: DetectionProblem, shape: Shape) -> list[NDArray]:
    """Return the torque of each amplitude of a cause or a law, (m, O, k) of each run."""
    return shape.parts(problem) if isinstance(shape, LawShape) else parts_of(shape, problem)


def sized(
    rivals: Sequence[Rival], problem: DetectionProblem, bounds: JointBounds
) -> list[SizedRival]:
    """Return rivals with the shapes and sizes that agree with what is known.

    Where nothing is a rival, the torque that runs showed is at most as large as its probability
    allows. Where a diagnosis fitted no rival, a cause makes a usual share of the joint's torque.

    Parameters
    ----------
    rivals : sequence of Rival
    problem : DetectionProblem
        Runs with the last excitation, or a usual one.
    bounds : JointBounds
        Of all motions, on which an unlisted law is a function.

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
    nothing = sum(rival.probability for rival in rivals if rival.is_nothing)
    nothing /= sum(rival.probability for rival in rivals)
    length = _seen_length(nothing, problem) if nothing > 0.0 else None
    seen = _seen(rivals, length, problem)
    return [_sized(rival, seen, length, problem, bounds) for rival in rivals]


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
    rival: Rival,
    seen: NDArray | None,
    length: float | None,
    problem: DetectionProblem,
    bounds: JointBounds,
) -> SizedRival:
    if rival.law and seen is not None:
        law = LawShape.of(rival.law, problem, bounds)
        return SizedRival(rival, tuple(_as_seen([law], seen, problem)), (law,))
    if rival.effect is None:
        return SizedRival(rival, (), ())
    grid = list(shapes_of(rival.effect, problem.runs))
    if seen is None:
        # A shape that these runs do not show has no size.
        sizes = ((one, _factor(one, length, problem)) for one in grid)
        truths = [Truth(one, factor) for one, factor in sizes if np.isfinite(factor)]
    elif rival.term is not None:
        own = _candidate(rival.term, problem)
        truths, grid = _as_seen([own], seen, problem), [own, *grid]
    else:
        truths = _as_seen(grid, seen, problem)
    if not truths:
        raise InputError(
            f"{rival.label} makes no torque with the last excitation; give `exoid design"
            f" {SETTING}` the other causes, or that run a wider motion"
        )
    return SizedRival(rival, tuple(truths), tuple(grid))


def _as_seen(grid: Sequence[Shape], seen: NDArray, problem: DetectionProblem) -> list[Truth]:
    """Return the shapes that explain a torque (rows,) about as well as the best one does."""
    # Log likelihood by which a shape may be worse: the others have an eighth of its probability.
    tolerance = 2.0
    truths, explained = list[list[Truth]](), list[float]()
    shown = problem.whitened(seen)
    for candidate in grid:
        columns = problem.whitened(problem.remainder(parts_in(problem, candidate)))
        gram = columns.T @ columns + np.diag(1.0 / _typical(candidate) ** 2)
        if not columns.any():
            continue
        linear = np.linalg.solve(gram, columns.T @ shown)
        explained.append(0.5 * float(shown @ columns @ linear))
        truths.append(_around(candidate, linear, np.linalg.inv(gram)))
    best = max(explained, default=0.0)
    pairs = zip(truths, explained, strict=True)
    return [one for own, gain in pairs if gain >= best - tolerance for one in own]


def _typical(candidate: Shape) -> NDArray:
    """Return a standard deviation of each amplitude before any data, (k,); two are typical."""
    if isinstance(candidate, LawShape):
        return candidate.typical
    if candidate.transforms_motion:
        return np.ones(1)  # of the size at which the shape is
    return np.array([0.5 * np.max(np.abs(p.typical)) for p in candidate.effect.linear])


def _around(candidate: Shape, linear: NDArray, covariance: NDArray) -> list[Truth]:
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
