"""Compute the smallest size of each cause that a motion and a noise level reveal, and its ties.

An effect of magnitude theta adds theta c to the measured torques; the baseline explains its share P
c and leaves theta (I - P) c. With each output's rows divided by its noise and multiplied by the
root of the share of independent samples, the log likelihood that naming the effect gains is half a
noncentral chi-square of noncentrality theta^2 |(I - P) c|^2. The effect is named where that gain
exceeds its price: the prior odds against a cause, and half the logarithm of the independent samples
for each amplitude. So

    theta_min = (z_a + z_b) / |(I - P) c|

with z_a^2 twice the price and z_b for the required power. A good rig shows a little of every cause
(``Criteria.background_cause``), so the smallest size also exceeds that by as much.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import ncx2

from pipelines.diagnosis.candidates.candidate import TURNS, Candidate, proposals
from pipelines.diagnosis.candidates.columns import torque_columns
from pipelines.diagnosis.candidates.library import Report, silent
from pipelines.diagnosis.candidates.shape_grid import BENDING, values_in, values_of
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.baseline import Baseline, baseline_of, with_load
from pipelines.diagnosis.evidence.baseline_columns import columns_under, gram_of_runs
from pipelines.diagnosis.evidence.block_rate import at_block_rate
from pipelines.diagnosis.evidence.downsampling import downsampled
from pipelines.diagnosis.evidence.eligibility import refuse_unfit
from pipelines.diagnosis.evidence.gram import solve
from pipelines.diagnosis.evidence.known_effects import known_effects
from pipelines.diagnosis.evidence.noise_floor import Floor, noise_floor
from pipelines.diagnosis.evidence.observed_run import Run, observe
from pipelines.diagnosis.fit.held_out import held_out_residuals
from pipelines.diagnosis.fit.joint_fit import fit
from pipelines.diagnosis.selection.prior import FEATURES, weights
from pipelines.effects import Effect, Parameter
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.scale import on_one_scale
from pipelines.model import TermColumns


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
    """``noise``, or ``materiality`` where a smaller effect is detectable but too small to
    matter."""
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
class DetectionProblem:
    """Detection problem of some runs: rows in units of the noise, the baseline projected out."""

    runs: tuple[Run, ...]
    baseline: Baseline
    untouched: tuple[NDArray, ...]
    values: NDArray
    """The baseline's values under which the motion is transformed."""
    root: NDArray
    """(O,) root of the independent share over the noise; zero without such an output."""
    independent: float
    """Independent samples of the output that has most."""
    basis: NDArray
    """(rows, size) orthonormal basis of the weighted baseline."""
    torque_rms: NDArray
    """(O,) N·m, of the baseline's torque."""

    @classmethod
    def of(cls, runs: Sequence[Run], baseline: Baseline, floor: Floor) -> "DetectionProblem":
        """Fit the baseline and prepare its projection.

        Parameters
        ----------
        runs : sequence of Run
            Planned or recorded runs.
        baseline : Baseline
            Rigid body and friction.
        floor : Floor
            Noise of each output, N·m.
        """
        untouched = tuple(columns_under((), run, baseline)[0] for run in runs)
        plain = gram_of_runs(runs, untouched)
        there = np.isfinite(floor.rms) & (floor.rms > 0)
        noise, share = np.where(there, floor.rms, 1.0), floor.independent_share
        drives = len(noise) // 2
        # A weight above one corrects noise that is overestimated from recordings; here it is given.
        weights = np.minimum([CRITERIA.drive_weight, CRITERIA.cuff_weight], 1.0)
        counts = np.repeat(weights, drives)
        # Correlated blocks count as fewer: the likelihood is scaled by their independent share.
        root = np.where(there, np.sqrt(counts * share) / noise, 0.0)
        independent = float(np.max(share * plain.count))
        values = solve(plain, root**2)
        # Torques that depend on load take it from the fitted bodies, as in a diagnosis.
        loaded = tuple(with_load(run, baseline, values) for run in runs)
        torque = np.concatenate(
            [(c @ values)[run.valid] for run, c in zip(runs, untouched, strict=True)]
        )
        rms = np.sqrt(np.mean(torque**2, axis=0))
        problem = cls(loaded, baseline, untouched, values, root, independent, np.zeros((0, 0)), rms)
        # The basis is made of weighted rows, which the problem itself provides.
        rows = problem.rows(untouched)
        # QR would invent a direction for a column of zeros.
        return replace(problem, basis=np.linalg.qr(rows[:, rows.any(axis=0)])[0])

    def rows(self, columns: Sequence[NDArray]) -> NDArray:
        """Return columns as weighted rows, usable ones only.

        Parameters
        ----------
        columns : sequence of (m, O, k) arrays
            One of each run, N·m per unit.

        Returns
        -------
        (rows, k) array
            In units of the noise.
        """
        scaled = (c * self.root[:, np.newaxis] for c in columns)
        return np.concatenate([s[run.usable] for run, s in zip(self.runs, scaled, strict=True)])

    def remainder(self, columns: Sequence[NDArray]) -> NDArray:
        """Return columns less their projection on the baseline.

        Parameters
        ----------
        columns : sequence of (m, O, k) arrays
            One of each run, N·m per unit.

        Returns
        -------
        (rows, k) array
            In units of the noise.
        """
        rows = self.rows(columns)
        for _ in range(2):  # twice is enough for orthogonality to rounding
            rows = rows - self.basis @ (self.basis.T @ rows)
        return rows

    def joint(self, effect: Effect) -> int:
        """Return the joint at which an effect's size is given: its own, if it is measured.

        For a whole machine it is the first, and otherwise the first measured one.
        """
        motion = self.runs[0].motion
        j = max(effect.column(motion), 0)
        return j if motion.machine.measured[j] else int(np.argmax(motion.machine.measured))

    def rms(self, effect: Effect, column: Sequence[NDArray]) -> float:
        """Return the rms of a column at the effect's joint, where it acts.

        Parameters
        ----------
        effect : Effect
            Whose joint and runs count.
        column : sequence of (m, O, 1) arrays
            One of each run, N·m.

        Returns
        -------
        float
            N·m.
        """
        j = self.joint(effect)
        # Runs in which the effect does not act would lower its rms.
        acting = [
            (r, c) for r, c in zip(self.runs, column, strict=True) if effect.explains(r.motion)
        ]
        return float(
            np.sqrt(np.mean(np.concatenate([c[r.usable[:, j], j, 0] for r, c in acting]) ** 2))
        )


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
    # An effect that the wearer may carry has the same name; the machine's is reported.
    motions = [run.motion for run in runs]
    effects = [
        e
        for e in proposals(baseline, baseline.kinds)
        if e.run is None and not e.each_run and e.shows_in(motions)
    ]
    results: dict[Effect, list[DetectionResult]] = {}
    for number, effect in enumerate(effects):
        report(number / len(effects), effect.label)
        of_shapes = [
            (_bent if candidate.transforms_motion else _added)(candidate, problem, power)
            for candidate in _shapes(effect, problem.runs)
        ]
        # Where no shape is plausible, all count: every cause is reported.
        results[effect] = [one for one in of_shapes if one.plausible] or of_shapes
    # Share of a family's shapes for which the smallest size suffices, as the shape is unknown
    # beforehand.
    usual = 0.8
    chosen = [
        sorted(own, key=lambda result: result.rms)[round(usual * (len(own) - 1))]
        for own in results.values()
    ]
    unexplained = _unexplained(chosen, list(results.values()))
    return [
        _detectable(effect, result, results, row, float(problem.torque_rms[problem.joint(effect)]))
        for effect, result, row in zip(effects, chosen, unexplained, strict=True)
    ]


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


def _shapes(effect: Effect, runs: Sequence[Run]) -> Iterator[Candidate]:
    """Yield the effect with shapes that span its family."""
    probe = Candidate(effect, ())
    chosen = effect.directions([run.motion for run in runs])
    if chosen:
        yield from (Candidate(effect, (shape,) * len(runs)) for shape in chosen[0])
        return
    if probe.transforms_motion:
        weak = values_of(effect.shape[0], BENDING)[-1]
        yield Candidate(effect, ((float(weak),),) * len(runs))
        return
    # Parts of a run at which an effect with per-run onsets may begin.
    onsets = (0.25, 0.5, 0.75)
    grids = [onsets if p.per_run else _seen(effect, p, runs) for p in effect.shape]
    for shape in itertools.product(*grids):
        yield Candidate(effect, tuple(_in_run(effect, shape, run) for run in runs))


def _seen(effect: Effect, parameter: Parameter, runs: Sequence[Run], most: int = 6) -> NDArray:
    """Return at most so many values of a shape parameter that represent its range.

    For a ripple, those that blocks pass. Faster ones are found at the full sampling rate
    (``order_tracking``), where they are as detectable.
    """
    values = values_in(effect, parameter, most, runs)
    if parameter.unit not in TURNS or effect.joint is None:
        return _spread(values, most)
    j = runs[0].motion.joint_index(effect.joint)
    speeds = np.concatenate([run.state[1][:, j] for run in runs])
    # A ripple of n cycles a turn has n |dq| / 2 pi Hz at the speed dq.
    fastest = 2.0 * np.pi * runs[0].bandwidth_hz / float(np.sqrt(np.mean(speeds**2)))
    return _spread(values[values <= max(fastest, values[0])], most)


def _spread(values: NDArray, most: int) -> NDArray:
    return values[np.unique(np.linspace(0, len(values) - 1, most).round().astype(int))]


def _in_run(effect: Effect, shape: Sequence[float], run: Run) -> tuple[float, ...]:
    begin, end = run.time[0], run.time[-1]
    return tuple(
        # An onset is a share of the run here; the effect needs a time.
        float(begin + v * (end - begin) if p.per_run else v)
        for p, v in zip(effect.shape, shape, strict=True)
    )


def _added(candidate: Candidate, problem: DetectionProblem, power: float) -> DetectionResult:
    """Find the size of an effect that adds torque in proportion to its amplitude."""
    effect = candidate.effect
    columns = [torque_columns(candidate, r, run) for r, run in enumerate(problem.runs)]
    direction = _direction(effect, columns, problem)
    own = candidate.columns_in([run.motion.run for run in problem.runs])
    span = problem.remainder([own.expand(column, r) for r, column in enumerate(columns)])
    remainder = problem.remainder(direction)[:, 0]
    growth, by = _growth(effect, remainder, direction, span.shape[1], problem, power)
    size, unit = float(np.sqrt(growth)), problem.rms(effect, direction)
    least, largest = np.sort(np.abs(effect.linear[0].typical))
    # A range of both signs includes zero, so there is no least size.
    if effect.linear[0].typical[0] < 0:
        least = 0.0
    torque = problem.torque_rms[problem.joint(effect)]
    # Share of a joint's torque that an effect of the largest typical size makes if it depends on
    # the motion.
    least_share = 1e-3
    return DetectionResult(
        candidate.shapes[0],
        size,
        size * unit if np.isfinite(size) else np.inf,
        by,
        _squared(remainder) * growth if np.isfinite(growth) else np.inf,
        _unit(remainder),
        _orthonormal(span),
        _orthonormal(problem.remainder(_wide(effect, columns, _levels(effect), problem.runs))),
        least * unit < torque and largest * unit > least_share * torque,
    )


def _companions(effect: Effect) -> list[int]:
    """Return the amplitudes that may have either sign and only accompany the first one."""
    # One that is zero by default refines the form, and no effect needs it to show.
    refines = [p.default is not None for p in effect.linear]
    return [i for i, p in enumerate(effect.linear) if i and p.typical[0] < 0 and not refines[i]]


def _levels(effect: Effect) -> list[int]:
    """Return those companions that differ in unit from the first amplitude.

    A preload accompanies a stiffness, for example.
    """
    return [i for i in _companions(effect) if effect.linear[i].unit != effect.linear[0].unit]


def _wide(
    effect: Effect, columns: Sequence[NDArray], chosen: list[int], runs: Sequence[Run]
) -> list[NDArray]:
    """Return some of an effect's columns, per-run ones in places of their own, (m, O, k)."""
    per_run = [effect.linear[i].per_run for i in chosen]
    own = TermColumns.of(effect, [run.motion.run for run in runs], per_run)
    return [own.expand(column[:, :, chosen], r) for r, column in enumerate(columns)]


def _direction(
    effect: Effect, columns: Sequence[NDArray], problem: DetectionProblem
) -> list[NDArray]:
    """Return the effect at unit magnitude, (m, O, 1) of each run.

    Companions of either sign (a preload, a level, the cosine of a sine) are chosen to minimise its
    torque: a spring rests in the middle of the motion, a drift starts at minus half of its end.
    """
    lead = [c[:, :, :1] for c in columns]
    companions = _companions(effect)
    if not companions:
        return lead
    wide = _wide(effect, columns, companions, problem.runs)
    usable = [run.usable for run in problem.runs]
    A, y = (
        np.concatenate([c[u] for c, u in zip(part, usable, strict=True)]) for part in (wide, lead)
    )
    values = np.linalg.lstsq(A, y[:, 0], rcond=1e-12)[0]
    return [c - (w @ values)[:, :, np.newaxis] for c, w in zip(lead, wide, strict=True)]


def _bent(candidate: Candidate, problem: DetectionProblem, power: float) -> DetectionResult:
    """Find the size of an effect that transforms the motion or a reading, by steps."""
    effect, start = candidate.effect, np.array(candidate.shapes[0])
    zero = np.array(
        # Forms are members of a family and no sizes, so they stay; other shapes shrink to neutral.
        [v if p.forms else p.neutral for v, p in zip(start, effect.shape, strict=False)]
    )
    reach = float(np.linalg.norm(start - zero))

    def at(x: float) -> tuple[float, str, NDArray, list[NDArray], float]:
        # Sizes span decades, so the search is over their logarithm.
        shape = zero + (start - zero) / reach * np.exp(x)
        column = _bend(replace(candidate, shapes=(tuple(shape),) * len(problem.runs)), problem)
        remainder = problem.remainder(column)[:, 0]
        growth, by = _growth(effect, remainder, column, 1, problem, power)
        return growth, by, remainder, column, float(effect.physical(effect.completed(shape))[0])

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
    growth, by, remainder, column, value = now
    # A growth of one means that this very size is just named.
    seen = np.isfinite(growth) and abs(np.log(growth)) < 0.2
    return DetectionResult(
        (),
        value if seen else np.inf,
        problem.rms(effect, column) if seen else np.inf,
        by,
        _squared(remainder) if seen else np.inf,
        _unit(remainder),
        _orthonormal(remainder[:, np.newaxis]),
        np.zeros((len(remainder), 0)),
        plausible=True,
    )


def _bend(candidate: Candidate, problem: DetectionProblem) -> list[NDArray]:
    """Return the change from the untouched to the transformed baseline, (m, O, 1) of each run.

    The effect is not linear, so the baseline is computed again from the transformed motion.
    Linearised at biased parameters, elasticity would be mistaken for an encoder offset.
    """
    changes = []
    for r, (run, untouched) in enumerate(zip(problem.runs, problem.untouched, strict=True)):
        columns, measured = columns_under([candidate.term(r)], run, problem.baseline)
        plain = untouched @ problem.values
        change = columns @ problem.values - plain - (measured - run.measured)
        changes.append(change[:, :, np.newaxis])
    return changes


def _growth(
    effect: Effect,
    remainder: NDArray,
    column: Sequence[NDArray],
    columns: int,
    problem: DetectionProblem,
    power: float,
) -> tuple[float, str]:
    """Return the factor by which an effect's square must grow to be named, and its limit."""
    # Share of an effect's square that the baseline does not explain, below which it explains all.
    nothing = 1e-10
    if _squared(remainder) <= nothing * _squared(problem.rows(column)[:, 0]):
        return np.inf, "noise"
    price = 0.5 * columns * np.log(problem.independent) - weights(CRITERIA)[FEATURES.index("cause")]
    by_noise = needed_noncentrality(columns, price, power) / _squared(remainder)
    # A good rig has a little of the effect: its amplitude is uncertain by that much.
    torque = max(float(problem.torque_rms[problem.joint(effect)]), np.finfo(float).tiny)
    share = problem.rms(effect, column) / torque
    # As against noise, the amplitude must exceed its background by the root of twice the price.
    by_background = (
        2.0 * price * (CRITERIA.background_cause / share) ** 2 if share > 0.0 else np.inf
    )
    if by_noise >= by_background:
        return by_noise, "noise"
    return by_background, "materiality"


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
    # Share of an effect that another does not explain, below which no size separates the two.
    never = 1e-3
    return Detectable(
        effect,
        result.rms,
        result.size,
        tuple(zip(names, result.shape, strict=True)),
        min(other.rms for other in results[effect]),
        result.by,
        tuple(label for _, label in alike),
        tuple(label for share, label in alike if share < never),
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


def _squared(x: NDArray) -> float:
    return float(np.sum(x * x))


def _unit(x: NDArray) -> NDArray:
    length = np.sqrt(_squared(x))
    return x / length if length > 0 else x


def _orthonormal(columns: NDArray) -> NDArray:
    """Return an orthonormal basis of the columns that are not zero, (rows, k)."""
    size = np.linalg.norm(columns, axis=0)
    if not size.any():
        return columns[:, :0]
    scaled = columns / np.where(size > 0, size, 1.0)
    u, s, _ = np.linalg.svd(scaled, full_matrices=False)
    return u[:, s > 1e-8 * s[0]]
