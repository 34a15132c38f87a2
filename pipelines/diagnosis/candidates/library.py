"""The candidate library: every cause and every law that competes, as columns of one regression.

Each cause stands in it at its best shape alone, with derivative columns along its shapes, and at
the next best of the coarse search. Where sets of causes are likely, it stands in it once more at
the shape that it has beside the others of the set.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate, proposals
from pipelines.diagnosis.candidates.candidate_rows import CandidateRows
from pipelines.diagnosis.candidates.cause import Cause, towards
from pipelines.diagnosis.candidates.law_rows import curve_rows, law_rows
from pipelines.diagnosis.candidates.shape_grid import others_of, screened
from pipelines.diagnosis.candidates.shape_refinement import Fitted, ShapeRefinement, has_shapes
from pipelines.diagnosis.candidates.smooth_laws import TIME, Curve, LawColumn
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.diagnosis.evidence.line_spectrum import Kind
from pipelines.diagnosis.evidence.prepared_runs import Prepared
from pipelines.effects import Cogging, Effect
from pipelines.wording.law import law_label

ALTERNATIVES = 2
"""Shapes of a cause besides its best one."""
SWEEPS = 2
"""Times that the causes of a set are refined in turn."""
Report = Callable[[float, str], None]


def silent(share: float, what: str) -> None:
    """Report to nobody."""


@dataclass(frozen=True)
class Context:
    """A set of causes and laws in which the causes are refined beside one another."""

    causes: tuple[int, ...]
    """Their numbers in the library."""
    laws: tuple[str, ...]
    """Variants of laws, as ``LawColumn.variant`` has them."""


@dataclass(frozen=True)
class Library:
    """Everything that competes, the baseline projected out."""

    prepared: Prepared
    regression: DecisionRegression
    rows: CandidateRows
    causes: tuple[Cause, ...]
    laws: tuple[LawColumn, ...]
    law_columns: NDArray
    """(N, l)."""
    curves: tuple[Curve, ...]
    """The curves of time."""
    curve_columns: NDArray
    """(N, t)."""
    left_out: tuple[str, ...] = ()
    """Labels of effects whose columns at every shape are not finite or add nothing to the
    baseline."""
    contexts: tuple[Context, ...] = ()
    """Sets whose causes were refined beside one another."""
    screened: tuple[tuple[Fitted, ...], ...] = ()
    """Of each effect the fits of its coarse search."""

    def refined_together(self, contexts: Sequence[Context]) -> "Library":
        """Return the library with the causes of some sets refined beside one another as well."""
        grown = self
        for context in contexts:
            grown = grown._with([self.causes[i] for i in context.causes], context.laws)
        return grown

    def with_partners(self, number: int, most: int) -> "Library":
        """Return the library with those causes that explain most beside one cause, refined with it.

        Beside a large cause a small one has another shape than alone.
        """
        grown, main = self, self.causes[number]
        rows_of_main = np.hstack([main.columns, main.derivative])
        alone = ShapeRefinement(self.rows, self.regression, rows_of_main)
        partners = [
            alone.best_of(fits)
            for fits in self.screened
            if fits[0].candidate.label != main.candidate.label
        ]
        fits = sorted((f for f in partners if f is not None), key=lambda f: -f.worth)
        for fitted in fits[:most]:
            none = np.zeros((len(rows_of_main), 0))
            cause = Cause.of(fitted, none, self.regression, first=True)
            grown = grown if cause is None else grown._with([main, cause])
        return grown

    def _with(self, added: Sequence[Cause], laws: Sequence[str] = ()) -> "Library":
        """Return the library with a set of causes refined beside one another as well."""
        own = self._together(list(added), laws)
        if own is None:
            return self
        count, number = len(self.causes), len(self.contexts)
        own = [replace(cause, context=number) for cause in own]
        context = Context(tuple(range(count, count + len(own))), tuple(laws))
        return replace(self, causes=(*self.causes, *own), contexts=(*self.contexts, context))

    def _together(self, refined_causes: list[Cause], laws: Sequence[str]) -> list[Cause] | None:
        """Return the causes of a set, each refined with the rest of it fitted freely."""
        regression = self.regression
        shaped = [n for n, cause in enumerate(refined_causes) if has_shapes(cause.candidate)]
        if not shaped or len(refined_causes) + len(laws) < 2:
            return None
        rows = [self._law(label) for label in laws]
        for _ in range(SWEEPS):
            for n in shaped:
                others = [
                    np.hstack([c.columns, c.derivative])
                    for k, c in enumerate(refined_causes)
                    if k != n
                ]
                other_rows = np.hstack([*rows, *others])
                alone = ShapeRefinement(self.rows, regression, other_rows)
                start = alone.fit(refined_causes[n].candidate)
                if start is None:
                    return None
                cause = Cause.of(*alone.refined(start), regression, first=True)
                if cause is None:
                    return None
                refined_causes[n] = cause
        return refined_causes

    def _law(self, variant: str) -> NDArray:
        """Return the rows of a law, (N, k)."""
        names = self.prepared.baseline.joints
        own = [law.variant(names) == variant for law in self.laws]
        if any(own):
            return self.law_columns[:, own]
        joint = [law_label(TIME, names[curve.joint]) == variant for curve in self.curves]
        return self.curve_columns[:, joint]


def build_library(prepared: Prepared, report: Report = silent) -> Library:
    """Compute every cause's and every law's columns."""
    misfit = CRITERIA.form_misfit * prepared.slow_rms
    regression = DecisionRegression.of(
        prepared.runs, prepared.columns, prepared.noise, prepared.torque, misfit
    )
    rows = CandidateRows(prepared.runs, prepared.baseline, regression)
    alone = ShapeRefinement(rows, regression)
    causes: list[Cause] = []
    left_out: list[str] = []
    grids: list[tuple[Fitted, ...]] = []
    effects = _effects(prepared)
    for number, effect in enumerate(effects):
        report(number / len(effects), effect.label)
        fits = screened(effect, alone, prepared.runs, regression)
        shapes = _shapes(fits, alone, regression)
        causes += shapes
        grids += [tuple(fits)] if fits else []
        left_out += [] if shapes else [effect.label]
    causes += _ripples(prepared, alone, regression)
    in_library = {cause.candidate.label for cause in causes}
    laws, law_columns = law_rows(prepared, regression)
    curves, curve_columns = curve_rows(prepared, regression)
    return Library(
        prepared,
        regression,
        rows,
        tuple(causes),
        tuple(laws),
        law_columns,
        tuple(curves),
        curve_columns,
        tuple(sorted(set(left_out) - in_library)),
        (),
        tuple(grids),
    )


def _effects(prepared: Prepared) -> list[Effect]:
    """Return the effects that the runs can show."""
    motions = [run.motion for run in prepared.runs]
    listed = proposals(prepared.baseline, [motion.run for motion in motions])
    return [effect for effect in listed if effect.shows_in(motions)]


def _ripples(
    prepared: Prepared, alone: ShapeRefinement, regression: DecisionRegression
) -> list[Cause]:
    """Return each joint's ripple as order tracking has it, at the full sampling rate."""
    ripples, machine = [], prepared.baseline.machine
    for joint in prepared.baseline.joints:
        if orders := orders_of(joint, prepared):
            effect = Cogging(joint, on=machine, lines=len(orders))
            fitted = alone.fit(Candidate(effect, (orders,) * len(prepared.runs)))
            if fitted is not None:
                none = np.zeros((len(fitted.columns), 0))
                ripples.append(Cause.of(fitted, none, regression, first=True))
    return [cause for cause in ripples if cause is not None]


def orders_of(joint: str, prepared: Prepared) -> tuple[float, ...]:
    """Return the cycles a turn of a joint's ripple, known at the full sampling rate."""
    lines = prepared.lines[prepared.baseline.joints.index(joint)]
    return tuple(line.cycles for line in lines.of_kind(Kind.ANGLE))


def _shapes(
    fits: Sequence[Fitted], alone: ShapeRefinement, regression: DecisionRegression
) -> list[Cause]:
    """Return an effect at its best shape, refined, and at the next best of the coarse search."""
    if not fits:
        return []
    swings = fits[0].candidate.effect.swings
    best, slopes = best_transmission(fits, alone) if swings else alone.refined(fits[0])
    # A refinement may go far from its start; of a transmission it is not known which start was the
    # best.
    others = others_of(fits, best if swings else fits[0], ALTERNATIVES)
    slopes = np.hstack([slopes, towards(best, others)])
    shaped = [Cause.of(best, slopes, regression, first=True)]
    none = np.zeros((len(slopes), 0))
    shaped += [Cause.of(other, none, regression, first=False) for other in others[:ALTERNATIVES]]
    return [cause for cause in shaped if cause is not None]


def best_transmission(fits: Sequence[Fitted], alone: ShapeRefinement) -> tuple[Fitted, NDArray]:
    """Return a transmission at its best shape, refined from several starts, and its slopes there,
    (N, d).

    Where a load swings the likelihood has several maxima, and which is the highest shows only with
    refitted bodies: the shape that is best with the baseline's bodies and the one that is best with
    refitted bodies are both refined.
    """
    plain = [fitted for fitted in fits if not fitted.candidate.bodies]
    refitted = [fitted for fitted in fits if fitted.candidate.bodies]
    refined = [alone.refined(kind[0]) for kind in (plain, refitted) if kind]
    return max(refined, key=lambda pair: pair[0].worth)
