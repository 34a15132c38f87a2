"""Build the candidate library: every competing cause and law, as columns of one regression.

Each cause has its best shape alone, with derivative columns along its shapes, and the next best
shapes of the coarse search. Where sets of causes are likely, it has one more: the shape refined
together with the others of the set.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate, proposals
from pipelines.diagnosis.candidates.candidate_rows import CandidateRows
from pipelines.diagnosis.candidates.cause import Cause, towards
from pipelines.diagnosis.candidates.law_rows import curve_rows, law_rows
from pipelines.diagnosis.candidates.shape_grid import others_of, screened
from pipelines.diagnosis.candidates.shape_refinement import (
    CandidateFit,
    ShapeRefinement,
    has_shapes,
)
from pipelines.diagnosis.candidates.smooth_laws import TIME, Curve, LawColumn
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.diagnosis.evidence.line_spectrum import Kind
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns
from pipelines.effects import EFFECTS, Effect
from pipelines.wording.law import law_label

Report = Callable[[float, str], None]


def silent(share: float, what: str) -> None:
    """Ignore a report of progress."""


@dataclass(frozen=True)
class Context:
    """A set of causes and laws whose causes are refined together."""

    causes: tuple[int, ...]
    """Their numbers in the library."""
    laws: tuple[str, ...]
    """Variants of laws, as of ``LawColumn.variant``."""


@dataclass(frozen=True)
class Library:
    """All competing causes and laws, the baseline projected out."""

    prepared: PreparedRuns
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
    """Sets whose causes were refined together."""
    screened: tuple[tuple[CandidateFit, ...], ...] = ()
    """The fits of each effect's coarse search."""

    def refined_together(self, contexts: Sequence[Context]) -> "Library":
        """Return the library with the causes of some sets refined together as well."""
        grown = self
        for context in contexts:
            grown = grown._with([self.causes[i] for i in context.causes], context.laws)
        return grown

    def with_partners(self, number: int, most: int) -> "Library":
        """Return the library with one cause refined with each of its best partners.

        Partners are the ``most`` causes that explain most in addition to it. In a set with a large
        cause, a small one has another shape than alone.
        """
        grown, main = self, self.causes[number]
        # With its derivatives the main cause may change its shape a little as a partner is fitted.
        rows_of_main = np.hstack([main.columns, main.derivative])
        alone = ShapeRefinement(self.rows, self.regression, rows_of_main)
        partners = [
            alone.best_of(fits)
            for fits in self.screened
            if fits[0].candidate.label != main.candidate.label
        ]
        fits = sorted((f for f in partners if f is not None), key=lambda f: -f.score)
        for fitted in fits[:most]:
            none = np.zeros((len(rows_of_main), 0))
            cause = Cause.of(fitted, none, self.regression, is_best_shape=True)
            grown = grown if cause is None else grown._with([main, cause])
        return grown

    def _with(self, added: Sequence[Cause], laws: Sequence[str] = ()) -> "Library":
        """Return the library with a set of causes refined together as well."""
        own = self._together(list(added), laws)
        if own is None:
            return self
        count, number = len(self.causes), len(self.contexts)
        # These shapes belong to this set: counted alone as well, a cause would count twice.
        own = [replace(cause, refined_in=number) for cause in own]
        context = Context(tuple(range(count, count + len(own))), tuple(laws))
        return replace(self, causes=(*self.causes, *own), contexts=(*self.contexts, context))

    def _together(self, refined_causes: list[Cause], laws: Sequence[str]) -> list[Cause] | None:
        """Return the causes of a set, each refined with the rest of it fitted freely."""
        regression = self.regression
        shaped = [n for n, cause in enumerate(refined_causes) if has_shapes(cause.candidate)]
        # Without a free shape, or without a partner, refinement would change nothing.
        if not shaped or len(refined_causes) + len(laws) < 2:
            return None
        rows = [self._law(label) for label in laws]
        # Twice, because each shape depends on those of the other causes.
        for _ in range(2):
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
                cause = Cause.of(*alone.refined(start), regression, is_best_shape=True)
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


def build_library(prepared: PreparedRuns, report: Report = silent) -> Library:
    """Compute the columns of every cause and every law.

    Parameters
    ----------
    prepared : PreparedRuns
        The searched runs under the baseline alone.
    report : callable, optional
        Takes the share that is done, 0 to 1, and the present effect.

    Returns
    -------
    Library
    """
    # No form follows a real effect exactly, so a share of the residual counts as noise.
    misfit = CRITERIA.form_misfit * prepared.slow_rms
    regression = DecisionRegression.of(
        prepared.runs, prepared.columns, prepared.noise, prepared.torque, misfit
    )
    rows = CandidateRows(prepared.runs, prepared.baseline, regression)
    alone = ShapeRefinement(rows, regression)
    causes: list[Cause] = []
    left_out: list[str] = []
    grids: list[tuple[CandidateFit, ...]] = []
    effects = _effects(prepared)
    for number, effect in enumerate(effects):
        report(number / len(effects), effect.label)
        fits = screened(effect, alone, prepared.runs, regression)
        shapes = _shapes(fits, alone, regression)
        causes += shapes
        grids += [tuple(fits)] if fits else []
        left_out += [] if shapes else [effect.label]
    # The coarse search sees slow waves only: block averages lose the fast ones.
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


def _effects(prepared: PreparedRuns) -> list[Effect]:
    """Return the effects that the runs can show."""
    motions = [run.motion for run in prepared.runs]
    listed = proposals(prepared.baseline, [motion.run for motion in motions])
    return [effect for effect in listed if effect.shows_in(motions)]


def _ripples(
    prepared: PreparedRuns, alone: ShapeRefinement, regression: DecisionRegression
) -> list[Cause]:
    """Return each joint's ripple from order tracking, at the full sampling rate."""
    ripples, machine = [], prepared.baseline.machine
    tracked = [effect for effect in EFFECTS if effect.order_tracked]
    for effect, joint in product(tracked, prepared.baseline.joints):
        orders = orders_of(joint, prepared)
        if orders:
            ripple = effect(joint, on=machine).with_parts(len(orders))
            fitted = alone.fit(Candidate(ripple, (orders,) * len(prepared.runs)))
            if fitted is not None:
                # Order tracking has refined the orders already, so they need no derivatives.
                none = np.zeros((len(fitted.columns), 0))
                ripples.append(Cause.of(fitted, none, regression, is_best_shape=True))
    return [cause for cause in ripples if cause is not None]


def orders_of(joint: str, prepared: PreparedRuns) -> tuple[float, ...]:
    """Return the cycles a turn of a joint's ripple, as found at the full sampling rate."""
    lines = prepared.lines[prepared.baseline.joints.index(joint)]
    return tuple(line.cycles for line in lines.of_kind(Kind.ANGLE))


def _shapes(
    fits: Sequence[CandidateFit], alone: ShapeRefinement, regression: DecisionRegression
) -> list[Cause]:
    """Return an effect at its best shape, refined, and at the next best of the coarse search."""
    if not fits:
        return []
    swings = fits[0].candidate.effect.swings
    best, slopes = best_transmission(fits, alone) if swings else alone.refined(fits[0])
    # Shapes of a cause in addition to its best one.
    alternatives = 2
    # A refinement may end far from its start, and it is unknown which start of a transmission led
    # to the best shape.
    others = others_of(fits, best if swings else fits[0], alternatives)
    slopes = np.hstack([slopes, towards(best, others)])
    shaped = [Cause.of(best, slopes, regression, is_best_shape=True)]
    none = np.zeros((len(slopes), 0))
    shaped += [
        Cause.of(other, none, regression, is_best_shape=False) for other in others[:alternatives]
    ]
    return [cause for cause in shaped if cause is not None]


def best_transmission(
    fits: Sequence[CandidateFit], alone: ShapeRefinement
) -> tuple[CandidateFit, NDArray]:
    """Return a transmission at its best shape.

    It is refined from several starts. Where a load swings, the likelihood has several maxima, and
    only refitted bodies show which is the highest. So the best shape with the baseline's bodies and
    the best shape with refitted bodies are both refined.

    Parameters
    ----------
    fits : sequence of CandidateFit
        Fits of one effect, the best first.
    alone : ShapeRefinement
        The baseline's rows alone.

    Returns
    -------
    tuple
        The fit, and its slopes (N, d).
    """
    plain = [fitted for fitted in fits if not fitted.candidate.bodies]
    refitted = [fitted for fitted in fits if fitted.candidate.bodies]
    refined = [alone.refined(kind[0]) for kind in (plain, refitted) if kind]
    return max(refined, key=lambda pair: pair[0].score)
