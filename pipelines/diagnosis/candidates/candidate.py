"""A candidate cause: an effect at a joint, and its shape in each run."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.effects import EFFECTS, Effect, Parameter
from pipelines.model import BASELINE, Term, TermColumns

NEVER, ALWAYS = 1e6, -1e6
"""s: onsets after every run's end and before every run's start."""
TURNS = ("1/turn", "rad/m")
"""Units of quantities that are counted along a joint's travel."""


@dataclass(frozen=True)
class Candidate:
    """An effect and its shape in each run."""

    effect: Effect
    shapes: tuple[tuple[float, ...], ...]
    """One for each run; they differ in per-run parameters only."""
    directions: tuple[tuple[float, ...], ...] = ()
    """Shapes that have a column each, where the effect is proportional to them; empty where it has
    one shape."""
    bodies: tuple[float, ...] = ()
    """Baseline values (b,) whose rigid bodies the library simulates a transmission with; empty: the
    baseline's own."""

    @property
    def label(self) -> str:
        """``effect@joint``."""
        return self.effect.label

    def term(self, run: int) -> Term:
        """Return the candidate as a term of a run's model, with zero amplitudes."""
        return Term.of(self.effect, self.shapes[run])

    def moved(self, i: int, step: float, runs: Sequence[int] | None = None) -> "Candidate":
        """Return the candidate with one shape larger by a step.

        Parameters
        ----------
        i : int
            Number of the shape.
        step : float
            In the shape's unit.
        runs : sequence of int, optional
            Runs that change; all by default.
        """
        return self.with_own(
            i, [now[i] + step * (runs is None or r in runs) for r, now in enumerate(self.shapes)]
        )

    def with_own(self, i: int, values: Sequence[float]) -> "Candidate":
        """Return the candidate with one shape of its own in each run.

        Parameters
        ----------
        i : int
            Number of the shape.
        values : sequence of float
            One value for each run, in the shape's unit.
        """
        shapes = zip(self.shapes, values, strict=True)
        return replace(
            self,
            shapes=tuple((*shape[:i], float(value), *shape[i + 1 :]) for shape, value in shapes),
        )

    def reshaped(self, i: int, value: float, runs: Sequence[int] | None = None) -> "Candidate":
        """Return the candidate with a new value of one shape.

        Parameters
        ----------
        i : int
            Number of the shape.
        value : float
            In the shape's unit.
        runs : sequence of int, optional
            Runs that change; all by default.
        """
        return self.with_own(
            i, [value if runs is None or r in runs else now[i] for r, now in enumerate(self.shapes)]
        )

    @property
    def transforms_motion(self) -> bool:
        """Whether the effect changes kinematics or readings, and adds no torque of its own."""
        return transforms_motion(self.effect)

    def columns_in(self, kinds: Sequence[str]) -> TermColumns:
        """Return the places of the candidate's columns.

        Parameters
        ----------
        kinds : sequence of str
            Kind of each run.
        """
        # A transformed motion gives a column for each direction, or one for the shape.
        width = max(1, len(self.directions))
        per_run = [self.effect.per_run] * width if self.transforms_motion else None
        return TermColumns.of(self.effect, kinds, per_run)

    def typical(self, kinds: Sequence[str]) -> NDArray:
        """Return the amplitude of each column of an effect as large as on other machines.

        Parameters
        ----------
        kinds : sequence of str
            Kind of each run.

        Returns
        -------
        (k,) array
            In the parameters' units. Where the effect transforms the motion, a column has its shape
            or is proportional to its direction.
        """
        if self.directions:
            sizes = [_largest(self.effect, direction) for direction in self.directions]
        elif self.transforms_motion:
            # The column is the change of torque at this very shape, so its amplitude is one.
            sizes = [1.0]
        else:
            sizes = [max(map(abs, parameter.typical)) for parameter in self.effect.linear]
        return np.array([sizes[k] for k, _ in self.columns_in(kinds).columns])

    @property
    def log_prior(self) -> float:
        """Log prior density of its shape over that of a uniform one in the typical range.

        Forms are equally likely. A free shape has Student's distribution about the middle of its
        typical range, with a quarter of the range as its scale. Where a joint's travel decides the
        range, or each run has a value, the density is uniform.
        """
        forms = prod(max(len(parameter.forms), 1) for parameter in self.effect.shape)
        free = [
            i
            for i, p in enumerate(self.effect.shape)
            if self.is_free(i) and not (p.swept or p.per_run)
        ]
        # With directions the amplitudes are the shape, and have a prior of their own.
        offs = [
            self.effect.shape[i].off_middle(self.shapes[0][i]) for i in free if not self.directions
        ]
        # Distances are in halves of the range, the scale is a quarter: a range is four scales long.
        return float(
            np.sum(np.log(4.0) + t.logpdf(2.0 * np.array(offs), CRITERIA.shape_freedom))
            - np.log(forms)
        )

    def is_free(self, i: int) -> bool:
        """Return whether shape ``i`` is fitted, not held at a default or one of its forms."""
        parameter = self.effect.shape[i]
        # A direction frees a shape with a default, as an encoder's error twice a turn.
        spanned = any(shape[i] != 0.0 for shape in self.directions)
        return not parameter.forms and (parameter.default is None or spanned)

    @property
    def per_run_transform(self) -> int | None:
        """Place of the per-run shape parameter that transforms the motion, None without one."""
        own = (i for i, p in enumerate(self.effect.shape) if p.per_run and self.transforms_motion)
        return next(own, None)

    @property
    def onset(self) -> int | None:
        """Place of the shape that is the instant of onset in each run, None without one."""
        # In the catalogue a per-run shape that adds torque is always an instant.
        own = (
            i for i, p in enumerate(self.effect.shape) if p.per_run and not self.transforms_motion
        )
        return next(own, None)


def transforms_motion(effect: Effect) -> bool:
    """Return whether an effect changes kinematics or readings, and adds no torque of its own."""
    # A torque sensor with a free shape acts on the whole torque, so no column is its own. One that
    # only adds a torque, such as an offset, has a column.
    shaped = any(p.default is None for p in effect.shape)
    return type(effect).corrected is not Effect.corrected or (
        effect.torque_reading is not None and shaped
    )


def _largest(effect: Effect, direction: Sequence[float]) -> float:
    """Return the largest typical size of an effect along a direction of its shapes."""
    pairs = zip(effect.shape, direction, strict=True)
    return max(max(map(abs, parameter.typical)) / abs(value) for parameter, value in pairs if value)


def lowest(effect: Effect, parameter: Parameter, runs: Sequence[Run]) -> float:
    """Return the smallest value of a shape parameter that runs can determine.

    Parameters
    ----------
    effect : Effect
        Bound to its joint.
    parameter : Parameter
        One of its shapes.
    runs : sequence of Run
        The searched runs.

    Returns
    -------
    float
        In the parameter's unit; minus infinity unless it counts cycles of the joint's angle.
    """
    if parameter.unit not in TURNS or effect.joint is None:
        return -np.inf
    j = runs[0].motion.joints.index(effect.joint)
    # All runs share the wave, so the one with the widest sweep decides.
    swept = max(float(np.ptp(run.state[0][:, j])) for run in runs)
    # Fewest waves of a ripple within the swept angles. With fewer it does not repeat, and
    # together with a spring it fits any function of the angle.
    fewest_waves = 1.5
    # A joint whose torque was not measured may rest, and shows no wave then.
    return fewest_waves * 2.0 * np.pi / swept if swept > 0.0 else np.inf


def proposals(baseline: Baseline, kinds: Sequence[str]) -> Iterator[Effect]:
    """Yield every effect at every place where a machine can have it.

    Parameters
    ----------
    baseline : Baseline
        Its effects are left out.
    kinds : sequence of str
        Kinds of the runs, ``exo_alone`` and ``with_human``.

    Yields
    ------
    Effect
        Bound to a joint; where useful also with values of its own in each run, or in runs
        with a person only.
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
            # In a single run, a value for each run is the plain candidate again.
            if effect.may_differ and len(kinds) > 1:
                yield effect(joint=joint, on=machine, each_run=True)
            # On the wearer the cuffs measure it too: it is another candidate than on the machine.
            if effect.may_be_worn and "with_human" in kinds:
                yield effect(joint=joint, run="with_human", on=machine)
