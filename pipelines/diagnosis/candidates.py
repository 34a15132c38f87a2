"""Candidates: an effect at a joint with a shape, and what it would add to each measured torque.

Every candidate becomes columns beside the baseline's. Torque effects give their own columns. Effects
that change kinematics or readings are not linear: the baseline is rebuilt as they would have it and
refitted there, and its difference from the untouched baseline under the same parameters is the column.
Linearised at biased parameters, elasticity would pass for an encoder offset.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.gram import Gram, gram_of, solve
from pipelines.diagnosis.observations import FOLDS, Baseline, Run
from pipelines.effects import EFFECTS, Effect, Parameter, Side
from pipelines.model import BASELINE, Model, Term

WORN = ("mass_off_axis", "payload_change")
"""Effects of the structure that the person may carry instead: then in their runs only, and felt by the cuffs."""
TURNS = ("1/turn", "rad/m")
"""Units of what is counted along a joint's way."""
WAVES = 1.5
"""Of a ripple within the angles that are swept: with fewer it is not seen to repeat, and beside a spring it could
imitate any function of the angle."""


@dataclass(frozen=True)
class Candidate:
    """An effect and its shape in each run."""

    effect: Effect
    shapes: tuple[tuple[float, ...], ...]
    """One for each run; they differ in parameters that each run has for itself."""
    directions: tuple[tuple[float, ...], ...] = ()
    """Shapes that have a column each, where the effect is in proportion to them; empty where it has one shape."""

    @property
    def label(self) -> str:
        """``effect@joint``."""
        return self.effect.label

    def term(self, run: int) -> Term:
        """Return the candidate as a term of a run's model, its amplitudes nought."""
        return Term(self.effect, np.append(np.zeros(len(self.effect.linear)), self.shapes[run]))

    def moved(self, i: int, step: float, runs: Sequence[int] | None = None) -> "Candidate":
        """Return the candidate with shape parameter ``i`` larger by a step, in some runs or in all."""
        return self.with_own(i, [now[i] + step * (runs is None or r in runs) for r, now in enumerate(self.shapes)])

    def with_own(self, i: int, values: Sequence[float]) -> "Candidate":
        """Return the candidate with a value of shape parameter ``i`` for each run."""
        shapes = zip(self.shapes, values, strict=True)
        return replace(self, shapes=tuple((*shape[:i], float(value), *shape[i + 1 :]) for shape, value in shapes))

    def reshaped(self, i: int, value: float, runs: Sequence[int] | None = None) -> "Candidate":
        """Return the candidate with another value of shape parameter ``i``, in some runs or in all."""
        return self.with_own(i, [value if runs is None or r in runs else now[i] for r, now in enumerate(self.shapes)])

    @property
    def bends(self) -> bool:
        """Whether the effect changes kinematics or readings rather than adding torque of its own."""
        return bends_motion(self.effect)

    @property
    def apart(self) -> list[bool]:
        """Which linear parameters have a column of their own for each run; none of one that bends."""
        return [p.per_run and not self.bends for p in self.effect.linear]

    @property
    def signature_apart(self) -> list[bool]:
        """The same of the columns of ``signatures``."""
        return [self.effect.per_run] * max(1, len(self.directions)) if self.bends else self.apart

    @property
    def own_bend(self) -> int | None:
        """Which shape parameter bends each run in a way of its own, None where none does."""
        own = (i for i, p in enumerate(self.effect.shape) if p.per_run and self.bends)
        return next(own, None)

    @property
    def onset(self) -> int | None:
        """Which shape parameter is the instant at which the effect begins in each run, None where it has none."""
        own = (i for i, p in enumerate(self.effect.shape) if p.per_run and not self.bends)
        return next(own, None)


def bends_motion(effect: Effect) -> bool:
    """Tell whether an effect changes kinematics or readings rather than adding torque of its own."""
    shaped = any(p.default is None for p in effect.shape)
    return type(effect).corrected is not Effect.corrected or (effect.torque_reading is not None and shaped)


def lowest(effect: Effect, parameter: Parameter, runs: Sequence[Run]) -> float:
    """Return the value below which runs cannot tell a shape parameter of an effect."""
    if parameter.unit not in TURNS or effect.joint is None:
        return -np.inf
    j = runs[0].motion.joints.index(effect.joint)
    swept = max(float(np.ptp(run.state[0][:, j])) for run in runs)
    return WAVES * 2.0 * np.pi / swept


def proposals(baseline: Baseline, kinds: Sequence[str]) -> Iterator[Effect]:
    """Yield every effect at every place of a machine where it can be, in the kinds of each run at hand.

    What is in the baseline already is none.
    """
    machine, known = baseline.machine, {effect.label for effect in baseline.known}
    for effect in EFFECTS:
        if effect.name in BASELINE or not set(effect.acts_in) & set(kinds):
            continue
        for joint in effect.possible(machine):
            plain = effect(joint=joint, on=machine)
            if plain.label in known:
                continue
            yield plain
            if effect.may_differ and len(kinds) > 1:
                yield effect(joint=joint, on=machine, each_run=True)
            if effect.name in WORN and "with_human" in kinds:
                yield effect(joint=joint, run="with_human", on=machine)


def columns_under(terms: Sequence[Term], run: Run, baseline: Baseline) -> tuple[NDArray, NDArray]:
    """Return the columns of the baseline and of some terms in one run, and what was measured.

    Terms bend the motion that everything is computed at, add their own torque, and stand between torque and reading.
    The force sensors sit on the links: their forces make another torque where those stand at another angle.

    Returns
    -------
    (m, O, size + linear parameters) columns and (m, O) measured torques, N·m.
    """
    motion = run.motion
    model = Model(tuple(terms))
    motor = model.sensed(motion)
    link = model.behind_motors(motor)
    limb = model.behind_cuffs(link)
    joints = len(baseline.joints)
    parts = [baseline.columns(motor, link, limb)]
    for term in sorted(terms, key=lambda t: t.effect.side is Side.SENSOR):
        effect = term.effect
        for part in parts:
            part[:, :joints] = effect.observed(part[:, :joints], motion, term.shape)
        at = limb if effect.on_limb else motor if effect.side is Side.DRIVE else link
        own = effect.columns(at, term.shape)
        parts.append(np.concatenate([own, own if effect.on_limb else np.zeros_like(own)], axis=1))
    return run.average(np.concatenate(parts, axis=2)), run.measured_at(link)


def gram_of_runs(runs: Sequence[Run], columns: Sequence[NDArray], measured: Sequence[NDArray] | None = None) -> Gram:
    """Multiply out all runs; ``measured`` (m, O) each where it is not the runs' own."""
    measured = measured or [run.measured for run in runs]
    grams = [gram_of(c, y, r.usable, r.fold, FOLDS) for r, c, y in zip(runs, columns, measured, strict=True)]
    total = grams[0]
    for gram in grams[1:]:
        total = total + gram
    return total


def signatures(
    candidate: Candidate,
    runs: Sequence[Run],
    baseline: Baseline,
    untouched: Sequence[NDArray],
    weights: NDArray,
    known: dict[tuple[float, ...], list[NDArray]] | None = None,
) -> list[NDArray]:
    """Return the candidate's columns in each run, (m, O, k).

    Parameters
    ----------
    untouched : the baseline's columns in each run
    weights : (O,) inverse variances, for the refit of effects that bend the motion
    known : the effect's columns along directions that were asked for before; those of new ones are added
    """
    if not candidate.bends:
        return [torque_columns(candidate, r, run) for r, run in enumerate(runs)]
    if candidate.directions:
        known = {} if known is None else known
        for shape in candidate.directions:
            if shape not in known:
                along = Candidate(candidate.effect, (shape,) * len(runs))
                known[shape] = signatures(along, runs, baseline, untouched, weights)
        parts = [known[shape] for shape in candidate.directions]
        return [np.concatenate(columns, axis=2) for columns in zip(*parts, strict=True)]
    under = [
        columns_under([candidate.term(r)], run, baseline) if candidate.effect.explains(run.motion)
        else (untouched[r], run.measured)
        for r, run in enumerate(runs)
    ]  # fmt: skip
    values = solve(gram_of_runs(runs, *zip(*under, strict=True)), weights)
    return [
        bent_column(columns, measured, values, plain, run)
        for (columns, measured), plain, run in zip(under, untouched, runs, strict=True)
    ]


def bent_column(columns: NDArray, measured: NDArray, values: NDArray, untouched: NDArray, run: Run) -> NDArray:
    """Return what the bent baseline's ``columns`` and ``measured`` torque add to the untouched ones, (m, O, 1) N·m."""
    plain = untouched @ values[: untouched.shape[2]]
    return (columns @ values - plain - (measured - run.measured))[:, :, np.newaxis]


def torque_columns(candidate: Candidate, number: int, run: Run) -> NDArray:
    """Return a torque effect's columns in one run, (m, O, k): in the drives, and in the cuffs where a person has it."""
    effect = candidate.effect
    own = run.average(effect.columns(run.motion, candidate.shapes[number]))
    return np.concatenate([own, own if effect.on_limb else np.zeros_like(own)], axis=1)


def expanded(columns: Sequence[NDArray], effect: Effect, apart: Sequence[bool], runs: Sequence[Run]) -> list[NDArray]:
    """Give those of an effect's columns that are ``apart`` one for each run the effect acts in, (m, O, k')."""
    if not any(apart):
        return list(columns)
    acting = [r for r, run in enumerate(runs) if effect.explains(run.motion)]
    wide = iter(expanded_columns([columns[r].reshape(-1, len(apart)) for r in acting], apart))
    width = apart.count(False) + apart.count(True) * len(acting)
    shapes = [c.shape[:2] for c in columns]
    return [
        next(wide).reshape(*shapes[r], width) if r in acting else np.zeros((*shapes[r], width))
        for r in range(len(runs))
    ]


def expanded_columns(parts: Sequence[NDArray], apart: Sequence[bool]) -> list[NDArray]:
    """Give those columns of each part (rows, k) that are ``apart`` a place of their own, nought in all other parts."""
    if not any(apart):
        return list(parts)
    shared, own = [i for i, a in enumerate(apart) if not a], [i for i, a in enumerate(apart) if a]
    wide = []
    for number, part in enumerate(parts):
        blocks = [part[:, own] if k == number else np.zeros((len(part), len(own))) for k in range(len(parts))]
        wide.append(np.hstack([part[:, shared], *blocks]))
    return wide
