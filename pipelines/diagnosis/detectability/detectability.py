"""The smallest size of each cause that a motion and a noise level would reveal, and the ties they
cannot break.

An effect of magnitude theta adds theta c to the measured torques; the baseline takes up its share P
c and leaves theta (I - P) c. With each output's rows divided by its noise and multiplied by the
root of the share of independent samples, the log likelihood that naming the effect gains is half a
noncentral chi-square of noncentrality theta^2 |(I - P) c|^2. It is named where that gain exceeds
its price: the prior odds against a cause, and half the logarithm of the independent samples for
each amplitude. So

    theta_min = (z_a + z_b) / |(I - P) c|

with z_a^2 twice the price and z_b for the power asked for. A good rig shows a little of every cause
(``Criteria.background_cause``), so the smallest size also exceeds that by as much.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import ncx2

from pipelines.diagnosis.candidates.candidate import TURNS, Candidate, proposals
from pipelines.diagnosis.candidates.columns import bent_column, torque_columns
from pipelines.diagnosis.candidates.shape_grid import BENDING, values_in, values_of
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.baseline import Baseline, baseline_of, with_load
from pipelines.diagnosis.evidence.baseline_columns import columns_under, gram_of_runs
from pipelines.diagnosis.evidence.block_rate import at_block_rate
from pipelines.diagnosis.evidence.downsampling import thinned
from pipelines.diagnosis.evidence.eligibility import refuse_unfit
from pipelines.diagnosis.evidence.gram import solve
from pipelines.diagnosis.evidence.known_effects import known_effects
from pipelines.diagnosis.evidence.noise_floor import Floor, noise_floor
from pipelines.diagnosis.evidence.observed_run import Run, observe
from pipelines.diagnosis.fit.held_out import evaluate
from pipelines.diagnosis.fit.joint_fit import fit
from pipelines.diagnosis.selection.prior import FEATURES, weights
from pipelines.effects import Effect, Parameter
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.scale import on_one_scale
from pipelines.model import TermColumns

POWER = 0.9
"""Chance that an effect of the smallest visible size is found."""
USUAL = 0.8
"""Share of a family's shapes that the smallest size is enough for, none being known beforehand."""
SHAPES = 6
"""Values of a free shape parameter that stand for its range."""
ONSETS = (0.25, 0.5, 0.75)
"""Of a run: when that may begin which has an onset of its own in each."""
DISTINGUISHED = np.log(20.0)
"""Log likelihood by which one cause must beat another for the two to be told apart: 20 to 1."""
NEVER = 1e-3
"""Share of an effect that another leaves, below which no size tells the two apart."""
NOTHING = 1e-10
"""Share of an effect's square that the baseline leaves, below which it leaves nothing."""
LEAST = 1e-3
"""Of a joint's torque: what an effect of the largest typical size makes where it has to do with the
motion at all."""
STEPS = 8
"""Of the search for the size of an effect that bends the motion."""


@dataclass(frozen=True)
class Detectable:
    """One cause at one joint."""

    effect: Effect
    smallest_rms_nm: float
    """Rms of its torque at its joint (else the first), before the baseline takes its share; inf:
    never seen."""
    smallest: float
    """The magnitude in the unit of ``parameter``."""
    shape: tuple[tuple[str, float], ...]
    """Shape parameters that the size holds for: it is enough for most of those tried, none being
    known beforehand."""
    best_rms_nm: float
    """The same rms at the shape that shows most."""
    limited_by: str
    """``noise``, or ``materiality`` where a smaller effect would show but be no reason to alarm."""
    tied_with: tuple[str, ...]
    """Causes that could not be told from this one at its smallest size."""
    never_apart: tuple[str, ...]
    """Those of them that no size tells from this one."""
    torque_rms_nm: float
    """Of the joint's torque in these runs: more than that no working leg hides."""

    @property
    def parameter(self) -> Parameter:
        """Return the parameter that says how large the effect is."""
        return self.effect.parameters[0]

    @property
    def unit(self) -> str:
        """Return the unit of its torque, N where the machine slides."""
        machine, joint = self.effect.on, self.effect.joint
        return (machine.joint(joint) if joint else machine.joints[0]).unit("torque")

    def size_in_words(self) -> str:
        """Write the smallest size with its unit, as tables and figures have it."""
        digits = f"{self.smallest:,.0f}" if abs(self.smallest) >= 100 else f"{self.smallest:.3g}"
        return digits if self.parameter.unit == "1" else f"{digits} {self.parameter.unit}"

    def as_json(self) -> dict:
        """Return a row of ``detectability.json``; null where no size would be seen."""
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
class Sight:
    """What can be seen in some runs: rows in units of the noise, the baseline projected out."""

    runs: tuple[Run, ...]
    baseline: Baseline
    untouched: tuple[NDArray, ...]
    values: NDArray
    """The baseline's values, that effects which bend the motion bend."""
    root: NDArray
    """(O,) root of the independent share over the noise and what a good rig leaves; nought without
    such an output."""
    noise: NDArray
    """(O,) N·m."""
    independent: float
    """Independent samples of the output that has most."""
    basis: NDArray
    """(rows, size) orthonormal basis of the weighted baseline."""
    torque_rms: NDArray
    """(O,) N·m, of the baseline's torque."""

    @classmethod
    def of(cls, runs: Sequence[Run], baseline: Baseline, floor: Floor) -> "Sight":
        """Fit the baseline and prepare its projection."""
        untouched = tuple(columns_under((), run, baseline)[0] for run in runs)
        plain = gram_of_runs(runs, untouched)
        there = np.isfinite(floor.rms) & (floor.rms > 0)
        noise, share = np.where(there, floor.rms, 1.0), floor.independent_share
        drives = len(noise) // 2
        # A weight above one makes up for noise that recordings tell too large; here it is given.
        weights = np.minimum([CRITERIA.drive_weight, CRITERIA.cuff_weight], 1.0)
        counts = np.repeat(weights, drives)
        root = np.where(there, np.sqrt(counts * share) / noise, 0.0)
        independent = float(np.max(share * plain.count))
        values = solve(plain, root**2)
        loaded = tuple(with_load(run, baseline, values) for run in runs)
        torque = np.concatenate(
            [(c @ values)[run.valid] for run, c in zip(runs, untouched, strict=True)]
        )
        rms = np.sqrt(np.mean(torque**2, axis=0))
        sight = cls(
            loaded, baseline, untouched, values, root, noise, independent, np.zeros((0, 0)), rms
        )
        return replace(sight, basis=np.linalg.qr(sight.rows(untouched))[0])

    def rows(self, columns: Sequence[NDArray]) -> NDArray:
        """Return columns (m, O, k) of each run as weighted rows (rows, k), usable ones only."""
        scaled = (c * self.root[:, np.newaxis] for c in columns)
        return np.concatenate([s[run.usable] for run, s in zip(self.runs, scaled, strict=True)])

    def outputs(self) -> NDArray:
        """Return each row's output, (rows,)."""
        return np.concatenate([np.nonzero(run.usable)[1] for run in self.runs])

    def remainder(self, columns: Sequence[NDArray]) -> NDArray:
        """Return what the baseline leaves of columns, (rows, k)."""
        rows = self.rows(columns)
        for _ in range(2):  # twice is enough for orthogonality to rounding
            rows = rows - self.basis @ (self.basis.T @ rows)
        return rows

    def joint(self, effect: Effect) -> int:
        """Return the joint at which an effect's size is told: a whole machine's at its first."""
        return max(effect.column(self.runs[0].motion), 0)

    def share(self, effect: Effect, column: Sequence[NDArray]) -> float:
        """Return the share of the joint's torque that a column (m, O, 1) makes."""
        return self.rms(effect, column) / max(
            float(self.torque_rms[self.joint(effect)]), np.finfo(float).tiny
        )

    def rms(self, effect: Effect, column: Sequence[NDArray]) -> float:
        """Return the rms (N·m) of a column (m, O, 1) at the effect's joint, over the runs in which
        it acts."""
        j = self.joint(effect)
        acting = [
            (r, c) for r, c in zip(self.runs, column, strict=True) if effect.explains(r.motion)
        ]
        return float(
            np.sqrt(np.mean(np.concatenate([c[r.usable[:, j], j, 0] for r, c in acting]) ** 2))
        )


@dataclass(frozen=True)
class Look:
    """An effect of one shape: its direction and what the baseline leaves of it."""

    shape: tuple[float, ...]
    size: float
    """Smallest magnitude, in the effect's unit."""
    rms: float
    by: str
    noncentrality: float
    """At the smallest magnitude."""
    remainder: NDArray
    """(rows,) of unit length; what the baseline leaves of the direction."""
    span: NDArray
    """(rows, k) orthonormal: all that the effect of this shape could explain."""
    level: NDArray
    """(rows, l) orthonormal: what of it a mere level explains, as a spring's preload or a drift's
    beginning does."""
    plausible: bool
    """Whether typical sizes of this shape make a torque that a joint could have, and any at all."""


def detectability(
    runs: Sequence[Run],
    baseline: Baseline,
    floor: Floor,
    power: float = POWER,
    report: Callable[[float, str], None] = lambda share, what: None,
) -> list[Detectable]:
    """Return every cause at every joint with the smallest size that these runs would reveal.

    Parameters
    ----------
    runs : what the diagnosis would be fitted to; of the measured torques only the baseline's fit is
    used floor : noise of each output, (O,), and its independent share power : chance with which an
    effect of the smallest size is found report : told the share done and the cause at hand
    """
    sight = Sight.of([at_block_rate(run) for run in runs], baseline, floor)
    # What the wearer may carry instead of the machine goes by the same name; the machine's is
    # reported.
    motions = [run.motion for run in runs]
    effects = [
        e
        for e in proposals(baseline, baseline.kinds)
        if e.run is None and not e.each_run and e.shows_in(motions)
    ]
    looks: dict[Effect, list[Look]] = {}
    for number, effect in enumerate(effects):
        report(number / len(effects), effect.label)
        results = list(_looks(effect, sight, power))
        looks[effect] = [look for look in results if look.plausible] or results
    chosen = [_usual(own) for own in looks.values()]
    unexplained = _unexplained(chosen, list(looks.values()))
    return [
        _detectable(effect, look, looks, row, float(sight.torque_rms[sight.joint(effect)]))
        for effect, look, row in zip(effects, chosen, unexplained, strict=True)
    ]


def detectability_of_recorded(
    motions: Sequence[Motion],
    power: float = POWER,
    report: Callable[[float, str], None] = lambda share, what: None,
    known: Sequence[str] = (),
) -> list[Detectable]:
    """Return the same for recorded motions, their noise measured from what does not repeat between
    periods.

    Training runs count, as they do for a diagnosis; where there is none, all do.
    """
    motions = on_one_scale(motions)
    refuse_unfit(motions)
    motions = [thinned(m) for m in motions]
    runs = [observe(m) for m in motions if m.purpose == "train"] or [observe(m) for m in motions]
    baseline = baseline_of(runs, known_effects(known, runs[0].motion.machine))
    active = np.any([run.usable.any(axis=0) for run in runs], axis=0).astype(float)
    plain = fit((), runs, baseline, active)
    plain = fit((), runs, baseline, plain.weights)
    return detectability(
        runs, baseline, noise_floor(runs, evaluate(plain, runs, baseline)), power, report
    )


def as_json(results: Sequence[Detectable]) -> dict:
    """Return what ``detectability.json`` holds."""
    return {"contract": "detectability/1", "causes": [one.as_json() for one in results]}


@cache
def needed_noncentrality(columns: int, price: float, power: float) -> float:
    """Return the noncentrality at which a log likelihood gain over ``columns`` exceeds its price
    with this power.

    (z_a + z_b)^2 for one column, with z_a^2 twice the price.
    """
    price = 2.0 * price
    return float(brentq(lambda x: ncx2.sf(price, columns, x) - power, 1e-3, 100.0 + 10.0 * price))


def _looks(effect: Effect, sight: Sight, power: float) -> Iterator[Look]:
    for candidate in _shapes(effect, sight.runs):
        if candidate.bends:
            yield _bent(candidate, sight, power)
        else:
            yield _added(candidate, sight, power)


def _shapes(effect: Effect, runs: Sequence[Run]) -> Iterator[Candidate]:
    """Yield the effect with shapes that span its family."""
    probe = Candidate(effect, ())
    if chosen := effect.directions([run.motion for run in runs]):
        yield from (Candidate(effect, (shape,) * len(runs)) for shape in chosen[0])
        return
    if probe.bends:
        weak = values_of(effect.shape[0], BENDING)[-1]
        yield Candidate(effect, ((float(weak),),) * len(runs))
        return
    grids = [ONSETS if p.per_run else _spread(_seen(effect, p, runs)) for p in effect.shape]
    for shape in itertools.product(*grids):
        yield Candidate(effect, tuple(_in_run(effect, shape, run) for run in runs))


def _seen(effect: Effect, parameter: Parameter, runs: Sequence[Run]) -> NDArray:
    """Return the values of a shape parameter that stand for its range.

    Of a ripple, those that blocks pass: faster ones are found at the full sampling rate
    (``order_tracking``), where they show no less.
    """
    values = values_in(effect, parameter, SHAPES, runs)
    if parameter.unit not in TURNS or effect.joint is None:
        return values
    j = runs[0].motion.joint_index(effect.joint)
    speeds = np.concatenate([run.state[1][:, j] for run in runs])
    fastest = 2.0 * np.pi * runs[0].bandwidth_hz / float(np.sqrt(np.mean(speeds**2)))
    return values[values <= max(fastest, values[0])]


def _spread(values: NDArray) -> NDArray:
    return values[np.unique(np.linspace(0, len(values) - 1, SHAPES).round().astype(int))]


def _in_run(effect: Effect, shape: Sequence[float], run: Run) -> tuple[float, ...]:
    begin, end = run.time[0], run.time[-1]
    return tuple(
        float(begin + v * (end - begin) if p.per_run else v)
        for p, v in zip(effect.shape, shape, strict=True)
    )


def _added(candidate: Candidate, sight: Sight, power: float) -> Look:
    """Size an effect that adds torque of its own: in proportion to its amplitude."""
    effect = candidate.effect
    columns = [torque_columns(candidate, r, run) for r, run in enumerate(sight.runs)]
    direction = _direction(effect, columns, sight)
    own = candidate.columns_in([run.motion.run for run in sight.runs])
    span = sight.remainder([own.expand(column, r) for r, column in enumerate(columns)])
    remainder = sight.remainder(direction)[:, 0]
    growth, by = _growth(effect, remainder, direction, span.shape[1], sight, power)
    size, unit = float(np.sqrt(growth)), sight.rms(effect, direction)
    least, largest = np.sort(np.abs(effect.linear[0].typical))
    if effect.linear[0].typical[0] < 0:
        least = 0.0
    torque = sight.torque_rms[sight.joint(effect)]
    return Look(
        candidate.shapes[0],
        size,
        size * unit if np.isfinite(size) else np.inf,
        by,
        _squared(remainder) * growth if np.isfinite(growth) else np.inf,
        _unit(remainder),
        _orthonormal(span),
        _orthonormal(sight.remainder(_wide(effect, columns, _levels(effect), sight.runs))),
        least * unit < torque and largest * unit > LEAST * torque,
    )


def _companions(effect: Effect) -> list[int]:
    """Return the amplitudes that may have either sign and only accompany the first one."""
    return [i for i, p in enumerate(effect.linear) if i and p.typical[0] < 0]


def _levels(effect: Effect) -> list[int]:
    """Return those companions that are another quantity than the first amplitude, as a preload
    beside a stiffness."""
    return [i for i in _companions(effect) if effect.linear[i].unit != effect.linear[0].unit]


def _wide(
    effect: Effect, columns: Sequence[NDArray], chosen: list[int], runs: Sequence[Run]
) -> list[NDArray]:
    """Return some of an effect's columns, those that each run has for itself in places of their
    own, (m, O, k)."""
    per_run = [effect.linear[i].per_run for i in chosen]
    own = TermColumns.of(effect, [run.motion.run for run in runs], per_run)
    return [own.expand(column[:, :, chosen], r) for r, column in enumerate(columns)]


def _direction(effect: Effect, columns: Sequence[NDArray], sight: Sight) -> list[NDArray]:
    """Return the effect at unit magnitude, (m, O, 1) of each run.

    Companions of either sign, a preload, a level, the cosine beside the sine, are such that it
    makes least torque: a spring rests in the middle of the motion, a drift starts at minus half of
    what it becomes.
    """
    lead = [c[:, :, :1] for c in columns]
    companions = _companions(effect)
    if not companions:
        return lead
    wide = _wide(effect, columns, companions, sight.runs)
    usable = [run.usable for run in sight.runs]
    A, y = (
        np.concatenate([c[u] for c, u in zip(part, usable, strict=True)]) for part in (wide, lead)
    )
    values = np.linalg.lstsq(A, y[:, 0], rcond=1e-12)[0]
    return [c - (w @ values)[:, :, np.newaxis] for c, w in zip(lead, wide, strict=True)]


def _bent(candidate: Candidate, sight: Sight, power: float) -> Look:
    """Size an effect that bends the motion or a reading: step until it is just seen."""
    effect, start = candidate.effect, np.array(candidate.shapes[0])
    zero = np.array(
        [v if p.forms else p.neutral for v, p in zip(start, effect.shape, strict=False)]
    )
    reach = float(np.linalg.norm(start - zero))

    def at(x: float) -> tuple[float, str, NDArray, list[NDArray], float]:
        shape = zero + (start - zero) / reach * np.exp(x)
        column = _bend(replace(candidate, shapes=(tuple(shape),) * len(sight.runs)), sight)
        remainder = sight.remainder(column)[:, 0]
        growth, by = _growth(effect, remainder, column, 1, sight, power)
        return growth, by, remainder, column, float(effect.physical(effect.completed(shape))[0])

    x0 = float(np.log(reach))
    x1 = x0 - np.log(1.5)
    before, now = at(x0), at(x1)
    for _ in range(STEPS):
        if not (np.isfinite(now[0]) and np.isfinite(before[0])) or abs(np.log(now[0])) < 0.02:
            break
        slope = (np.log(now[0]) - np.log(before[0])) / (x1 - x0)
        if abs(slope) < 0.1:
            break
        x0, x1 = x1, x1 - float(np.clip(np.log(now[0]) / slope, -2.0, 2.0))
        before, now = now, at(x1)
    growth, by, remainder, column, value = now
    seen = np.isfinite(growth) and abs(np.log(growth)) < 0.2
    return Look(
        (),
        value if seen else np.inf,
        sight.rms(effect, column) if seen else np.inf,
        by,
        _squared(remainder) if seen else np.inf,
        _unit(remainder),
        _orthonormal(remainder[:, np.newaxis]),
        np.zeros((len(remainder), 0)),
        plausible=True,
    )


def _bend(candidate: Candidate, sight: Sight) -> list[NDArray]:
    """Return what the bent baseline adds to the untouched one, (m, O, 1) of each run."""
    return [
        bent_column(
            *columns_under([candidate.term(r)], run, sight.baseline),
            sight.values,
            sight.untouched[r],
            run,
        )
        for r, run in enumerate(sight.runs)
    ]


def _growth(
    effect: Effect,
    remainder: NDArray,
    column: Sequence[NDArray],
    columns: int,
    sight: Sight,
    power: float,
) -> tuple[float, str]:
    """Return the factor by which an effect's square must grow to be named, and what asks for it."""
    if _squared(remainder) <= NOTHING * _squared(sight.rows(column)[:, 0]):
        return np.inf, "noise"
    price = 0.5 * columns * np.log(sight.independent) - weights(CRITERIA)[FEATURES.index("cause")]
    by_noise = needed_noncentrality(columns, price, power) / _squared(remainder)
    # A good rig has a little of the effect, as if its amplitude were known to so much.
    share = sight.share(effect, column)
    by_background = (
        2.0 * price * (CRITERIA.background_cause / share) ** 2 if share > 0.0 else np.inf
    )
    if by_noise >= by_background:
        return by_noise, "noise"
    return by_background, "materiality"


def _usual(looks: list[Look]) -> Look:
    """Return the look that shows less than most shapes do: the size that it needs is enough for
    ``USUAL`` of them."""
    return sorted(looks, key=lambda look: look.rms)[round(USUAL * (len(looks) - 1))]


def _detectable(
    effect: Effect,
    look: Look,
    looks: dict[Effect, list[Look]],
    unexplained: NDArray,
    torque_rms: float,
) -> Detectable:
    """Put together what is known of one cause; ``unexplained`` is the share of it that each cause
    leaves."""
    others = sorted(zip(unexplained, (other.label for other in looks), strict=True))
    alike = [
        (share, label) for share, label in others if label != effect.label and _alike(look, share)
    ]
    names = [p.name for p in effect.shape] if look.shape else []
    return Detectable(
        effect,
        look.rms,
        look.size,
        tuple(zip(names, look.shape, strict=True)),
        min(other.rms for other in looks[effect]),
        look.by,
        tuple(label for _, label in alike),
        tuple(label for share, label in alike if share < NEVER),
        torque_rms,
    )


def _alike(look: Look, unexplained: NDArray | float) -> NDArray:
    if not np.isfinite(look.noncentrality):  # seen at no size
        return np.zeros(np.shape(unexplained), bool)
    return 0.5 * look.noncentrality * np.asarray(unexplained) < DISTINGUISHED


def _unexplained(chosen: Sequence[Look], looks: Sequence[list[Look]]) -> NDArray:
    """Return the share of each effect that each cannot explain, the sine squared of the angle
    between them, (e, e).

    A mere level does not count as an explanation: a spring without stiffness is an offset, and
    called that.
    """
    every = [other for others in looks for other in others]
    directions = np.array([look.remainder for look in chosen])
    by_level = 1.0 - _explained(directions, [other.level for other in every])
    shares = np.maximum(1.0 - _explained(directions, [other.span for other in every]), 0.0)
    for row, look, level in zip(shares, chosen, by_level, strict=True):
        row[_alike(look, level)] = 1.0
    first = np.cumsum([0, *(len(others) for others in looks[:-1])])
    return np.minimum.reduceat(shares, first, axis=1)


def _explained(directions: NDArray, spans: Sequence[NDArray]) -> NDArray:
    """Return the share of each unit vector (e, rows) in each orthonormal span (rows, k), (e,
    spans)."""
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
    """Return an orthonormal basis of what of the columns is there, (rows, k)."""
    size = np.linalg.norm(columns, axis=0)
    if not size.any():
        return columns[:, :0]
    scaled = columns / np.where(size > 0, size, 1.0)
    u, s, _ = np.linalg.svd(scaled, full_matrices=False)
    return u[:, s > 1e-8 * s[0]]
