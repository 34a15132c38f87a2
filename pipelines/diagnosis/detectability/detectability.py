"""Compute the smallest size of each cause that a motion and a noise level reveal, and its ties.

An effect of magnitude theta adds theta c to the measured torques; the baseline explains its share P
c and leaves theta (I - P) c. With each output's rows divided by its noise and multiplied by the
root of the share of independent samples, the log likelihood that naming the effect gains is half a
noncentral chi-square of noncentrality theta^2 |(I - P) c|^2. The effect is named where that gain
exceeds its price: the prior odds against a cause, and half the logarithm of the independent samples
for each amplitude. So

    theta_min = (z_a + z_b) / |(I - P) c|

with z_a^2 twice the price and z_b for the required power. A good rig shows a little of every cause
(``Criteria.background_cause``). As in a diagnosis, that is noise, too: the part of (I - P) c that
the causes' columns explain together counts less.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import ncx2

from pipelines.diagnosis.candidates.candidate import Candidate, proposals
from pipelines.diagnosis.candidates.columns import torque_columns
from pipelines.diagnosis.candidates.library import Report, silent
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.diagnosis.detectability.directions import (
    bend,
    chosen_columns,
    direction_of,
    levels,
    orthonormal,
    squared,
    traces_of,
    unit_vector,
    with_background,
)
from pipelines.diagnosis.detectability.shapes import shapes_of
from pipelines.diagnosis.evidence.baseline import Baseline, baseline_of
from pipelines.diagnosis.evidence.block_rate import at_block_rate
from pipelines.diagnosis.evidence.downsampling import downsampled
from pipelines.diagnosis.evidence.eligibility import refuse_unfit
from pipelines.diagnosis.evidence.known_effects import known_effects
from pipelines.diagnosis.evidence.noise_floor import Floor, noise_floor
from pipelines.diagnosis.evidence.observed_run import Run, observe
from pipelines.diagnosis.fit.held_out import held_out_residuals
from pipelines.diagnosis.fit.joint_fit import fit
from pipelines.diagnosis.selection.prior import FEATURES, weights
from pipelines.effects import Effect, Parameter
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.scale import on_one_scale

NEVER_APART = 1e-3
"""Share of an effect's power that another does not explain, below which no size separates them."""


@dataclass(frozen=True)
class Detectable:
    """One cause at one joint."""

    effect: Effect
    smallest_rms_nm: float
    """Rms of its torque at its joint (else the first), before the baseline explains its share; inf:
    never detected."""
    smallest: float
    """The magnitude in the unit of ``parameter``."""
    shape: tuple[tuple[str, float], ...]
    """Shape parameters that the size holds for: it suffices for most of those tried, as the shape
    is unknown beforehand."""
    best_rms_nm: float
    """The same rms at the shape that is easiest to detect."""
    limited_by: str
    """``noise``, or ``background`` where most of what noise leaves of it resembles what a good rig
    has of all causes."""
    tied_with: tuple[str, ...]
    """Causes that cannot be separated from this one at its smallest size."""
    never_apart: tuple[str, ...]
    """Those of them that cannot be separated at any size."""
    torque_rms_nm: float
    """Of the joint's torque in these runs: no working leg hides more."""

    @property
    def parameter(self) -> Parameter:
        """The parameter that gives the size of the effect."""
        return self.effect.parameters[0]

    @property
    def unit(self) -> str:
        """The unit of its torque, N where the machine slides."""
        machine, joint = self.effect.on, self.effect.joint
        return (machine.joint(joint) if joint else machine.joints[0]).unit("torque")

    def size_in_words(self) -> str:
        """Return the smallest size with its unit, as in tables and figures."""
        digits = f"{self.smallest:,.0f}" if abs(self.smallest) >= 100 else f"{self.smallest:.3g}"
        return digits if self.parameter.unit == "1" else f"{digits} {self.parameter.unit}"

    def as_json(self) -> dict:
        """Return a row of ``detectability.json``; null where no size is detected."""
        seen = bool(np.isfinite(self.smallest_rms_nm))
        return {
            "effect": self.effect.name,
            "joint": self.effect.joint,
            "smallest_rms_nm": self.smallest_rms_nm if seen else None,
            "smallest": {
                "value": self.smallest if seen else None,
                "unit": self.parameter.unit,
                "parameter": self.parameter.name,
            },
            "shape": dict(self.shape),
            "best_rms_nm": self.best_rms_nm if np.isfinite(self.best_rms_nm) else None,
            "torque_rms_nm": self.torque_rms_nm,
            "limited_by": self.limited_by,
            "tied_with": list(self.tied_with),
            "never_apart": list(self.never_apart),
        }


@dataclass(frozen=True)
class DetectionResult:
    """Detection result of an effect at one shape."""

    shape: tuple[float, ...]
    size: float
    """Smallest magnitude, in the effect's unit."""
    rms: float
    by: str
    noncentrality: float
    """At the smallest magnitude."""
    remainder: NDArray
    """(rows,) of unit length; the part of the direction that the baseline does not explain."""
    span: NDArray
    """(rows, k) orthonormal: all that the effect of this shape can explain."""
    level: NDArray
    """(rows, l) orthonormal: the part that a constant explains, as a spring's preload or a drift's
    start."""
    plausible: bool
    """Whether typical sizes of this shape make a torque that is not zero and that a joint can
    have."""
    candidate: Candidate

    def behind(self, problem: DetectionProblem, power: float) -> "DetectionResult":
        """Return the result behind the background of a good rig, by which a size grows."""
        if not np.isfinite(self.size):
            return self
        share = problem.shown(self.remainder)
        # Most of what noise leaves of it may be background.
        by = "noise" if share > 0.5 else "background"
        if self.candidate.transforms_motion:
            return replace(_bent(self.candidate, problem, power), by=by)
        growth = float(np.sqrt(1.0 / share))
        return replace(self, size=growth * self.size, rms=growth * self.rms, by=by)


def detectability(
    runs: Sequence[Run],
    baseline: Baseline,
    floor: Floor,
    power: float = 0.9,
    report: Report = silent,
) -> list[Detectable]:
    """Return every cause at every joint with the smallest size that these runs reveal.

    Parameters
    ----------
    runs : sequence of Run
        Runs that a diagnosis would be fitted to. Of the measured torques only the baseline's fit is
        used.
    baseline : Baseline
    floor : Floor
        Noise of each output, (O,), and its independent share.
    power : float, optional
        Chance with which an effect of the smallest size is detected.
    report : callable, optional
        Takes the share that is done, 0 to 1, and the present cause.

    Returns
    -------
    list of Detectable
    """
    problem = DetectionProblem.of([at_block_rate(run) for run in runs], baseline, floor)
    results = of_all_causes(problem, power, report)
    effects = list(results)
    chosen = [usual(own) for own in results.values()]
    unexplained = _unexplained(chosen, list(results.values()))
    return [
        _detectable(effect, result, results, row, float(problem.torque_rms[problem.joint(effect)]))
        for effect, result, row in zip(effects, chosen, unexplained, strict=True)
    ]


def of_all_causes(
    problem: DetectionProblem, power: float, report: Report = silent
) -> dict[Effect, list[DetectionResult]]:
    """Return the smallest size of each cause at each plausible shape, behind the background."""
    results = by_noise(problem, power, report)
    problem = with_background(problem, traces_of(usual_candidates(results), problem))
    return {e: [one.behind(problem, power) for one in own] for e, own in results.items()}


def by_noise(
    problem: DetectionProblem, power: float = 0.9, report: Report = silent
) -> dict[Effect, list[DetectionResult]]:
    """Return the smallest size of each cause at each plausible shape, by noise alone."""
    # An effect that the wearer may carry has the same name; the machine's is reported.
    motions = [run.motion for run in problem.runs]
    effects = [
        e
        for e in proposals(problem.baseline, problem.baseline.kinds)
        if e.run is None and not e.each_run and e.shows_in(motions)
    ]
    results: dict[Effect, list[DetectionResult]] = {}
    for number, effect in enumerate(effects):
        report(number / len(effects), effect.label)
        results[effect] = at_each_shape(effect, problem, power)
    return results


def usual_candidates(results: Mapping[Effect, Sequence[DetectionResult]]) -> list[Candidate]:
    """Return each cause that noise does not hide, at its usual shape."""
    chosen = [usual(own) for own in results.values()]
    return [one.candidate for one in chosen if np.isfinite(one.size)]


def at_each_shape(effect: Effect, problem: DetectionProblem, power: float) -> list[DetectionResult]:
    """Return the smallest size of an effect at each plausible shape, by noise alone."""
    of_shapes = [
        (_bent if candidate.transforms_motion else _added)(candidate, problem, power)
        for candidate in shapes_of(effect, problem.runs)
    ]
    # Where no shape is plausible, all count: every cause is reported.
    return [one for one in of_shapes if one.plausible] or of_shapes


def usual(results: Sequence[DetectionResult]) -> DetectionResult:
    """Return the result that suffices for most shapes, as the shape is unknown beforehand."""
    # Share of a family's shapes for which the smallest size suffices.
    most = 0.8
    return sorted(results, key=lambda result: result.rms)[round(most * (len(results) - 1))]


def detectability_of_recorded(
    motions: Sequence[Motion],
    power: float = 0.9,
    report: Report = silent,
    known: Sequence[str] = (),
) -> list[Detectable]:
    """Return the detectability of recorded motions, with noise from differences of periods.

    Training runs are used, as for a diagnosis; where there is none, all are.

    Parameters
    ----------
    motions : sequence of Motion
    power, report
        As for ``detectability``.
    known : sequence of str, optional
        Labels of effects that the machine is known to have.

    Returns
    -------
    list of Detectable

    Raises
    ------
    InputError
        Where no diagnosis could be made of the motions.
    """
    motions = on_one_scale(motions)
    refuse_unfit(motions)
    motions = [downsampled(m) for m in motions]
    runs = [observe(m) for m in motions if m.purpose == "train"] or [observe(m) for m in motions]
    baseline = baseline_of(runs, known_effects(known, runs[0].motion.machine))
    active = np.any([run.usable.any(axis=0) for run in runs], axis=0).astype(float)
    # Fit twice: outputs weigh alike first, then by their residuals.
    plain = fit((), runs, baseline, active)
    plain = fit((), runs, baseline, plain.weights)
    return detectability(
        runs, baseline, noise_floor(runs, held_out_residuals(plain, runs, baseline)), power, report
    )


def as_json(results: Sequence[Detectable]) -> dict:
    """Return the contents of ``detectability.json``."""
    return {"contract": "detectability/1", "causes": [one.as_json() for one in results]}


@cache
def needed_noncentrality(columns: int, price: float, power: float) -> float:
    """Return the noncentrality at which a gain exceeds its price.

    It is (z_a + z_b)^2 for one column, with z_a^2 twice the price.

    Parameters
    ----------
    columns : int
        Degrees of freedom of the gain.
    price : float
        Log likelihood ratio that the gain must exceed.
    power : float
        Probability that it does.
    """
    price = 2.0 * price
    # The power rises with the noncentrality, so there is one root.
    return float(brentq(lambda x: ncx2.sf(price, columns, x) - power, 1e-3, 100.0 + 10.0 * price))


def _added(candidate: Candidate, problem: DetectionProblem, power: float) -> DetectionResult:
    """Find the size of an effect that adds torque in proportion to its amplitude."""
    effect = candidate.effect
    columns = [torque_columns(candidate, r, run) for r, run in enumerate(problem.runs)]
    direction = direction_of(effect, columns, problem)
    own = candidate.columns_in([run.motion.run for run in problem.runs])
    span = problem.remainder([own.expand(column, r) for r, column in enumerate(columns)])
    remainder = problem.remainder(direction)[:, 0]
    growth = _growth(remainder, direction, span.shape[1], problem, power)
    size, unit = float(np.sqrt(growth)), problem.rms(effect, direction)
    least, largest = np.sort(np.abs(effect.linear[0].typical))
    # A range of both signs includes zero, so there is no least size.
    if effect.linear[0].typical[0] < 0:
        least = 0.0
    torque = problem.torque_rms[problem.joint(effect)]
    # Share of a joint's torque that an effect of the largest typical size makes if it depends on
    # the motion.
    least_share = 1e-3
    level = chosen_columns(effect, columns, levels(effect), problem.runs)
    return DetectionResult(
        candidate.shapes[0],
        size,
        size * unit if np.isfinite(size) else np.inf,
        "noise",
        squared(remainder) * growth if np.isfinite(growth) else np.inf,
        unit_vector(remainder),
        orthonormal(span),
        orthonormal(problem.remainder(level)),
        least * unit < torque and largest * unit > least_share * torque,
        candidate,
    )


def _bent(candidate: Candidate, problem: DetectionProblem, power: float) -> DetectionResult:
    """Find the size of an effect that transforms the motion or a reading, by steps."""
    effect, start = candidate.effect, np.array(candidate.shapes[0])
    zero = np.array(
        # Forms are members of a family and no sizes, so they stay; other shapes shrink to neutral.
        [v if p.forms else p.neutral for v, p in zip(start, effect.shape, strict=False)]
    )
    reach = float(np.linalg.norm(start - zero))

    def at(x: float) -> tuple[float, NDArray, list[NDArray], float]:
        # Sizes span decades, so the search is over their logarithm.
        shape = zero + (start - zero) / reach * np.exp(x)
        column = bend(replace(candidate, shapes=(tuple(shape),) * len(problem.runs)), problem)
        remainder = problem.remainder(column)[:, 0]
        growth = _growth(remainder, column, 1, problem, power)
        return growth, remainder, column, float(effect.physical(effect.completed(shape))[0])

    x0 = float(np.log(reach))
    x1 = x0 - np.log(1.5)
    before, now = at(x0), at(x1)
    for _ in range(8):
        if not (np.isfinite(now[0]) and np.isfinite(before[0])) or abs(np.log(now[0])) < 0.02:
            break
        # Secant steps: for a small effect, growth over size is a line of slope -2 in logarithms.
        slope = (np.log(now[0]) - np.log(before[0])) / (x1 - x0)
        if abs(slope) < 0.1:
            break
        # The effect is not proportional to its size, so a step is at most a factor of e².
        x0, x1 = x1, x1 - float(np.clip(np.log(now[0]) / slope, -2.0, 2.0))
        before, now = now, at(x1)
    growth, remainder, column, value = now
    # A growth of one means that this very size is just named.
    seen = np.isfinite(growth) and abs(np.log(growth)) < 0.2
    return DetectionResult(
        (),
        value if seen else np.inf,
        problem.rms(effect, column) if seen else np.inf,
        "noise",
        problem.shown(remainder) if seen else np.inf,
        unit_vector(remainder),
        orthonormal(remainder[:, np.newaxis]),
        np.zeros((len(remainder), 0)),
        plausible=True,
        candidate=candidate,
    )


def _growth(
    remainder: NDArray,
    column: Sequence[NDArray],
    columns: int,
    problem: DetectionProblem,
    power: float,
) -> float:
    """Return the factor by which an effect's square must grow to be named."""
    # Share of an effect's square that the baseline does not explain, below which it explains all.
    nothing = 1e-10
    if squared(remainder) <= nothing * squared(problem.rows(column)[:, 0]):
        return np.inf
    price = 0.5 * columns * np.log(problem.independent) - weights(CRITERIA)[FEATURES.index("cause")]
    return needed_noncentrality(columns, price, power) / problem.shown(remainder)


def _detectable(
    effect: Effect,
    result: DetectionResult,
    results: dict[Effect, list[DetectionResult]],
    unexplained: NDArray,
    torque_rms: float,
) -> Detectable:
    """Combine the results of one cause.

    ``unexplained`` is the share of it that each cause does not explain.
    """
    # The most similar causes come first.
    others = sorted(zip(unexplained, (other.label for other in results), strict=True))
    alike = [
        (share, label) for share, label in others if label != effect.label and _alike(result, share)
    ]
    names = [p.name for p in effect.shape] if result.shape else []
    return Detectable(
        effect,
        result.rms,
        result.size,
        tuple(zip(names, result.shape, strict=True)),
        min(other.rms for other in results[effect]),
        result.by,
        tuple(label for _, label in alike),
        tuple(label for share, label in alike if share < NEVER_APART),
        torque_rms,
    )


def _alike(result: DetectionResult, unexplained: NDArray | float) -> NDArray:
    if not np.isfinite(result.noncentrality):  # detected at no size
        return np.zeros(np.shape(unexplained), bool)
    # Log likelihood by which one cause must exceed another for the two to be separated: 20 to 1.
    distinguished = np.log(20.0)
    return 0.5 * result.noncentrality * np.asarray(unexplained) < distinguished


def _unexplained(
    chosen: Sequence[DetectionResult], results: Sequence[list[DetectionResult]]
) -> NDArray:
    """Return the share of each effect that each other cannot explain, (e, e).

    It is the sine squared of the angle between them. A constant level does not count as an
    explanation: a spring without stiffness is an offset, and is reported as one.
    """
    every = [other for others in results for other in others]
    directions = np.array([result.remainder for result in chosen])
    # A rival that explains the effect by its level alone is an offset, and no tie.
    by_level = 1.0 - _explained(directions, [other.level for other in every])
    shares = np.maximum(1.0 - _explained(directions, [other.span for other in every]), 0.0)
    for row, result, level in zip(shares, chosen, by_level, strict=True):
        row[_alike(result, level)] = 1.0
    first = np.cumsum([0, *(len(others) for others in results[:-1])])
    # Of each rival the shape counts that explains most.
    return np.minimum.reduceat(shares, first, axis=1)


def _explained(directions: NDArray, spans: Sequence[NDArray]) -> NDArray:
    """Return the share of each unit vector (e, rows) in each span (rows, k), (e, spans)."""
    # One product with all bases next to each other; cumulated sums separate them again.
    squares = (directions @ np.hstack(spans)) ** 2
    ends = np.cumsum([0, *(span.shape[1] for span in spans)])
    total = np.hstack([np.zeros((len(squares), 1)), np.cumsum(squares, axis=1)])
    return total[:, ends[1:]] - total[:, ends[:-1]]
