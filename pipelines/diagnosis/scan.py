"""The coarse search over shapes: which few of an effect's shapes are worth a closer look.

Columns are computed at the blocks' own rate and compared with what the baseline leaves. That is cheap
enough for grids as fine as a rhythm over a minute needs, and only ranks shapes of one effect.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import TURNS, Candidate, bends_motion, expanded_columns, lowest
from pipelines.diagnosis.line_spectrum import Kind
from pipelines.diagnosis.observations import Run
from pipelines.diagnosis.onset import NEVER
from pipelines.diagnosis.order_tracking import JointLines
from pipelines.effects import Cogging, Effect, Parameter
from pipelines.mechanics.motion import Motion

KEPT = 3
"""Shapes of an effect that go on."""
FEW, BENDING, SPRINGS = 16, 3, 8
"""Values of a shape parameter; of one that bends the motion, for its effect is nearly in proportion to it; of a
stiffness, for a load that swings on it does so at another frequency."""
HARDENING = ("1/rad²", "1/m²")
"""Units of a form that only bends a spring."""
ONSETS = 40
"""Instants tried for what begins at a time of its own in each run."""
SLOW_WAVES = 4.0
"""Times the fewest waves of a ripple, up to which block averages are searched for one."""
OSCILLATING = {"Hz", *TURNS}
"""Units of parameters whose effect has many maxima along them."""


@dataclass(frozen=True)
class Scan:
    """The runs at block rate, and the baseline projected out of everything."""

    runs: tuple[Run, ...]
    coarse: tuple[Motion, ...]
    roots: tuple[NDArray, ...]
    """(m, O) root of each sample's weight in each run, nought where it is not usable."""
    basis: tuple[NDArray, ...]
    """(m * O, size) orthonormal basis of the weighted baseline, cut by run."""
    left: tuple[NDArray, ...]
    """(m * O,) weighted residual of the baseline, cut by run."""
    lines: tuple[JointLines, ...] = ()
    """Of each joint's residual at the full sampling rate."""

    @classmethod
    def of(
        cls,
        runs: Sequence[Run],
        untouched: Sequence[NDArray],
        weights: NDArray,
        lines: Sequence[JointLines] = (),
    ) -> "Scan":
        """Prepare a scan of runs with baseline columns ``untouched`` (m, O, b), outputs weighed by ``weights`` (O,)."""
        roots = [np.sqrt(weights) * run.usable for run in runs]
        weighted = [(c * r[:, :, np.newaxis]).reshape(-1, c.shape[2]) for c, r in zip(untouched, roots, strict=True)]
        lengths = np.cumsum([len(w) for w in weighted])[:-1]
        basis, _ = np.linalg.qr(np.concatenate(weighted))
        y = np.concatenate([(run.measured * r).ravel() for run, r in zip(runs, roots, strict=True)])
        left = y - basis @ (basis.T @ y)
        return cls(
            tuple(runs), tuple(_coarse(run) for run in runs), tuple(roots),
            tuple(np.split(basis, lengths)), tuple(np.split(left, lengths)), tuple(lines),
        )  # fmt: skip

    def columns(self, effect: Effect, shape: Sequence[float], r: int) -> NDArray:
        """Return the weighted columns of a torque effect in one run, (m * O, k)."""
        own = effect.columns(self.coarse[r], tuple(shape))
        if not np.isfinite(own).all():  # a memory so fast that block rate cannot follow it promises nothing here
            own = np.zeros_like(own)
        both = np.concatenate([own, own if effect.on_limb else np.zeros_like(own)], axis=1)
        return (both * self.roots[r][:, :, np.newaxis]).reshape(-1, own.shape[2])

    def gain(self, effect: Effect, shape: Sequence[float]) -> float:
        """Return how much of the weighted squared residual the effect's columns would take."""
        apart = [p.per_run for p in effect.linear]
        parts = [self.columns(effect, shape, r) for r in range(len(self.runs)) if effect.explains(self.coarse[r])]
        where = [r for r in range(len(self.runs)) if effect.explains(self.coarse[r])]
        wide = expanded_columns(parts, apart)
        projected = sum(self.basis[r].T @ w for r, w in zip(where, wide, strict=True))
        gram = sum(w.T @ w for w in wide) - projected.T @ projected
        right = sum(w.T @ self.left[r] for r, w in zip(where, wide, strict=True))
        return float(right @ np.linalg.lstsq(gram, right, rcond=1e-6)[0])

    def gain_in_run(self, effect: Effect, shape: Sequence[float], r: int) -> float:
        """Return the same for one run alone, its amplitude its own."""
        column = self.columns(effect, shape, r)
        square = column.T @ column
        right = column.T @ self.left[r]
        return float(right @ np.linalg.lstsq(square, right, rcond=1e-6)[0])


def _coarse(run: Run) -> Motion:
    """Return the motion at block rate."""
    m, (q, dq, ddq) = run.motion, run.state
    J = len(m.joints)
    return replace(
        m, time=run.time, q=q, dq=dq, ddq=ddq, torque=run.measured[:, :J], segment=m.segment[run.starts],
        valid=run.valid, load=None if m.load is None else run.average(m.load),
        limb_load=None if m.limb_load is None else run.average(m.limb_load), forces=None,
        temperature=None if m.temperature is None else run.block.mean(m.motor_temperature, run.starts),
        sample_rate_hz=m.sample_rate_hz / run.block.decimation,
    )  # fmt: skip


def worth_a_look(effect: Effect, scan: Scan) -> list[Candidate]:
    """Return the few shapes of an effect that promise most."""
    bends = bends_motion(effect)
    if chosen := effect.directions([run.motion for run in scan.runs]):
        return [_along(effect, directions, len(scan.runs)) for directions in chosen]
    if isinstance(effect, Cogging):
        return ripples(effect, scan)
    shapes = list(_grid(effect, bends, scan.runs))
    runs = len(scan.runs)
    if bends or len(shapes) == 1:
        made = [Candidate(effect, (shape,) * runs) for shape in shapes]
    elif any(p.per_run for p in effect.shape):
        made = _with_onsets(effect, scan)
    else:
        gains = np.array([scan.gain(effect, shape) for shape in shapes])
        made = [Candidate(effect, (shapes[i],) * runs) for i in _peaks(gains, shapes, effect)]
    return made


def ripples(effect: Cogging, scan: Scan) -> list[Candidate]:
    """Return the ripples of a joint worth a closer look: each line of its residual, and all of them.

    Lines are known from the residual at the full sampling rate. Those of so few waves that they are
    no lines there, for want of resolution, are looked for in block averages as other shapes are.
    """
    runs, joint = len(scan.runs), effect.column(scan.coarse[0])
    found = scan.lines[joint].of_kind(Kind.ANGLE) if scan.lines else ()
    tried = values_in(effect, effect.shape[0], FEW, scan.runs)
    least = lowest(effect, effect.shape[0], scan.runs)
    slow = tried[(tried >= least) & (tried <= SLOW_WAVES * least)]
    gains = np.array([scan.gain(effect, (order,)) for order in slow])
    orders = [float(slow[i]) for i in _peaks(gains, [(order,) for order in slow], effect)]
    orders += [line.cycles for line in found]
    made = [Candidate(effect, ((order,),) * runs) for order in orders]
    if len(found) > 1:
        several = replace(effect, lines=len(found))
        made.append(Candidate(several, (tuple(line.cycles for line in found),) * runs))
    return made


def _along(effect: Effect, directions: Sequence[tuple[float, ...]], runs: int) -> Candidate:
    """Return a candidate with a column for each direction; a refinement starts from all of them together."""
    start = np.where([bool(p.forms) for p in effect.shape], directions[0], np.sum(directions, axis=0))
    return Candidate(effect, (tuple(start.tolist()),) * runs, tuple(directions))


def _grid(effect: Effect, bends: bool, runs: Sequence[Run]) -> Iterator[tuple[float, ...]]:
    """Yield the shapes to try; where each is dear, forms that only bend a spring are left to the refinement."""
    few = FEW if not bends else SPRINGS if effect.swings else BENDING
    yield from itertools.product(*(
        (tried := values_in(effect, p, few, runs))[tried >= lowest(effect, p, runs)]
        if not (effect.swings and p.unit in HARDENING) else (p.default,) for p in effect.shape
    ))  # fmt: skip


def values_in(effect: Effect, parameter: Parameter, count: int, runs: Sequence[Run]) -> NDArray:
    """Return the values of a shape parameter of an effect that are tried on some runs, (count,) or fewer."""
    if not parameter.swept or effect.joint is None:
        return values_of(parameter, count)
    angles = np.concatenate([run.state[0][:, run.motion.joint_index(effect.joint)] for run in runs])
    return np.linspace(np.min(angles), np.max(angles), count + 2)[1:-1]


def values_of(parameter: Parameter, count: int) -> NDArray:
    """Return the values of a shape parameter that are tried, (count,) or fewer, in its unit."""
    if parameter.forms:
        return np.array(parameter.forms)
    if parameter.default is not None:
        return np.array([parameter.default])
    low, high = parameter.typical
    if parameter.unit == "Hz":
        return np.arange(low, high, 0.01)
    if parameter.unit in TURNS:
        return np.arange(low, high, parameter.grain)
    if low > 0 and high / low > 4:
        # Away from the ends, where an effect that bends the motion does nothing or tears it apart.
        return np.geomspace(low, high, count + 2)[1:-1] if count < FEW else np.geomspace(low, high, count)
    values = np.linspace(low, high, count + 2)[1:-1] if count < FEW else np.linspace(low, high, count)
    return values[np.abs(values - parameter.neutral) > 0.02 * (high - low)]


def _peaks(gains: NDArray, shapes: Sequence[tuple[float, ...]], effect: Effect) -> list[int]:
    """Return the best shapes; along an oscillating parameter only one of each maximum."""
    order = np.argsort(-gains)
    if not any(p.unit in OSCILLATING for p in effect.shape):
        return [int(i) for i in order[:KEPT]]
    kept: list[int] = []
    for i in order:
        if all(abs(int(i) - k) > 2 for k in kept):
            kept.append(int(i))
        if len(kept) == KEPT:
            break
    return kept


def _with_onsets(effect: Effect, scan: Scan) -> list[Candidate]:
    """Find each run's own onset, at the instant where the effect takes most; never where it takes next to nothing."""
    shapes, gains = [], []
    defaults = [p.default for p in effect.shape]
    at = next(i for i, p in enumerate(effect.shape) if p.per_run)
    for r, motion in enumerate(scan.coarse):
        onsets = np.linspace(motion.time[0], motion.time[-1], ONSETS + 2)[1:-1]
        tried = [tuple(onset if i == at else d or 0.0 for i, d in enumerate(defaults)) for onset in onsets]
        taken = [scan.gain_in_run(effect, shape, r) if effect.explains(motion) else 0.0 for shape in tried]
        best = int(np.argmax(taken))
        shapes.append(tried[best])
        gains.append(taken[best])
    worthwhile = 0.1 * max(gains)
    chosen = tuple(
        shape if gain > worthwhile else tuple(NEVER if i == at else v for i, v in enumerate(shape))
        for shape, gain in zip(shapes, gains, strict=True)
    )
    return [Candidate(effect, chosen)]
