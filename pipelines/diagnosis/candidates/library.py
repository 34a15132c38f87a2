"""The candidate library: every cause and every law as weighted rows of one regression.

Each cause stands in it at its best shape alone, with derivative columns along its shapes, and at
the next best of the coarse search. Columns of one cause are made orthonormal, so that the square
of a cause's coefficients is the squared share of the joint's torque that it has.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate, proposals
from pipelines.diagnosis.candidates.columns import columns_under, gram_of_runs, signatures
from pipelines.diagnosis.candidates.gram import solve, weights_under
from pipelines.diagnosis.candidates.shape_grid import others_of, screened
from pipelines.diagnosis.candidates.shape_refinement import Alone, Fitted
from pipelines.diagnosis.candidates.smooth_laws import (
    IN_CUFFS,
    LawColumn,
    Spans,
    curves_of_time,
    smooth_laws,
)
from pipelines.diagnosis.evidence.baseline import Baseline, with_load
from pipelines.diagnosis.evidence.block_rate import at_block_rate, needs_full_rate
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.diagnosis.evidence.model_error import telling_torque
from pipelines.diagnosis.evidence.noise_model import NoiseModel, noise_model
from pipelines.diagnosis.evidence.observed_run import Run

ALTERNATIVES = 2
"""Shapes of a cause besides its best one."""
RANK = 1e-6
"""Relative share below which a column of a cause adds nothing to those before it."""
Report = Callable[[float, str], None]


def silent(share: float, what: str) -> None:
    """Report to nobody."""


@dataclass(frozen=True)
class Prepared:
    """The training runs under the baseline alone."""

    runs: tuple[Run, ...]
    """With the loads that the baseline's rigid bodies make."""
    baseline: Baseline
    columns: tuple[NDArray, ...]
    """(m, O, b) the baseline's columns in each run."""
    values: NDArray
    """(b,) the baseline fitted alone."""
    weights: NDArray
    """(O,) inverse variances under it."""
    noise: NoiseModel
    torque: NDArray
    """(O,) N·m rms."""

    @property
    def residuals(self) -> list[NDArray]:
        """What the baseline leaves, (m, O) N·m of each run."""
        return [r.measured - c @ self.values for r, c in zip(self.runs, self.columns, strict=True)]


def prepare(runs: Sequence[Run], baseline: Baseline) -> Prepared:
    """Fit the baseline alone and measure the noise of what it leaves."""
    columns = tuple(columns_under((), run, baseline)[0] for run in runs)
    gram = gram_of_runs(runs, columns)
    weights = weights_under(gram)
    values = solve(gram, weights)
    laden = tuple(with_load(run, baseline, values) for run in runs)
    residuals = [r.measured - c @ values for r, c in zip(runs, columns, strict=True)]
    noise = noise_model(laden, residuals)
    return Prepared(laden, baseline, columns, values, weights, noise, telling_torque(runs))


@dataclass(frozen=True)
class Cause:
    """One shape of a cause in the library."""

    candidate: Candidate
    columns: NDArray
    """(N, k) orthonormal shares."""
    amplitudes: NDArray
    """(p, k): the effect's own amplitudes per coefficient."""
    derivative: NDArray
    """(N, d) what its shapes do, each per unit of change."""
    first: bool
    """Whether it is the best shape of its effect."""


@dataclass(frozen=True)
class Library:
    """Everything that competes, as rows of the regression with the baseline projected out."""

    prepared: Prepared
    regression: DecisionRegression
    causes: tuple[Cause, ...]
    laws: tuple[LawColumn, ...]
    law_columns: NDArray
    """(N, l)."""
    curves: tuple[tuple[int, int, float], ...]
    """Joint, run and relative prior variance of each curve of time."""
    curve_columns: NDArray
    """(N, t)."""
    left_out: tuple[str, ...] = ()
    """Labels of effects whose columns are not finite at any shape, or add nothing."""


def build_library(prepared: Prepared, report: Report = silent) -> Library:
    """Compute every cause's and every law's columns."""
    regression = DecisionRegression.of(prepared.runs, prepared.columns, prepared.noise, prepared.torque)
    laws, law_columns = _laws(prepared, regression)
    curves, curve_columns = _curves(prepared, regression)
    columns = _Columns(prepared, regression)
    fast = Alone(columns.at_block_rate, regression.project, regression.measured)
    exact = Alone(columns, regression.project, regression.measured)
    motions = [run.motion for run in prepared.runs]
    listed = proposals(prepared.baseline, [motion.run for motion in motions])
    effects = [effect for effect in listed if effect.shows_in(motions)]
    causes: list[Cause] = []
    left_out: list[str] = []
    for number, effect in enumerate(effects):
        report(number / len(effects), effect.label)
        fits = screened(effect, fast.fit, prepared.runs, regression)
        shapes = _shapes(fits, exact, regression)
        causes += shapes
        left_out += [] if shapes else [effect.label]
    return Library(
        prepared, regression, tuple(causes), tuple(laws), law_columns, tuple(curves),
        curve_columns, tuple(dict.fromkeys(left_out)),
    )  # fmt: skip


def _shapes(fits: Sequence[Fitted], exact: Alone, regression: DecisionRegression) -> list[Cause]:
    """Return an effect at its best shape, refined, and at the next best of the coarse search."""
    start = exact.fit(fits[0].candidate) if fits else None
    if start is None:
        return []
    best, slopes = exact.refined(start)
    shaped = [_cause(best, slopes, True, regression)]
    for other in others_of(fits, best, ALTERNATIVES):
        shaped.append(_cause(other, np.zeros((len(slopes), 0)), False, regression))
    return [cause for cause in shaped if cause.columns.shape[1]]


def _cause(fitted: Fitted, slopes: NDArray, first: bool, regression: DecisionRegression) -> Cause:
    """Return a candidate with orthonormal columns, the baseline projected out."""
    # The effect's own first amplitude keeps its sign as the last column of the triangle.
    shares = regression.shares(fitted.columns)
    _, triangle = np.linalg.qr(shares[:, ::-1])
    size = np.abs(np.diag(triangle))
    kept = np.flatnonzero(size > RANK * max(size.max(initial=0.0), np.finfo(float).tiny))
    inverse = np.linalg.pinv(triangle)[::-1][:, kept]
    return Cause(
        fitted.candidate, regression.project(fitted.columns @ inverse), inverse,
        regression.project(slopes), first,
    )  # fmt: skip


def _laws(prepared: Prepared, regression: DecisionRegression) -> tuple[list[LawColumn], NDArray]:
    """Return every smooth law and its rows (N, l)."""
    joints = regression.joints
    spans = Spans.of(prepared.runs, prepared.torque[:joints])
    drives, laws = [], []
    for run, columns in zip(prepared.runs, prepared.columns, strict=True):
        laws, values = smooth_laws(run, spans, (columns @ prepared.values)[:, :joints])
        drives.append(values * spans.torque[:, np.newaxis])
    zero = [np.zeros_like(x) for x in drives]
    worn = [x * (run.motion.run == "with_human") for x, run in zip(drives, prepared.runs, strict=True)]
    felt = bool(np.isfinite(prepared.noise.density[joints:]).any())
    kinds = {run.motion.run for run in prepared.runs}
    parts = [(list(laws), _both(drives, zero))]
    if "with_human" in kinds and (len(kinds) == 2 or felt):
        parts.append(([replace(law, wearer="human") for law in laws], _both(worn, worn)))
    if felt:
        chosen = [i for i, law in enumerate(laws) if law.kind in IN_CUFFS]
        own = [replace(laws[i], wearer="cuffs") for i in chosen]
        parts.append((own, [x[:, :, chosen] for x in _both(zero, worn)]))
    rows = [regression.project(regression.rows(columns)) for _, columns in parts]
    return [law for some, _ in parts for law in some], np.hstack(rows)


def _both(drives: Sequence[NDArray], cuffs: Sequence[NDArray]) -> list[NDArray]:
    """Put columns of drives and of cuffs, (m, J, k) each, over one another."""
    return [np.concatenate([d, c], axis=1) for d, c in zip(drives, cuffs, strict=True)]


def _curves(prepared: Prepared, regression: DecisionRegression) -> tuple[list[tuple[int, int, float]], NDArray]:
    """Return joint, run and prior variance of every curve of time, and their rows (N, t)."""
    told, rows = [], []
    for r, run in enumerate(prepared.runs):
        curves, variance = curves_of_time(run)
        for j in range(regression.joints):
            parts = [np.zeros((*other.measured.shape, len(variance))) for other in prepared.runs]
            parts[r][:, j] = curves * prepared.torque[j]
            told += [(j, r, float(v)) for v in variance]
            rows.append(regression.project(regression.rows(parts)))
    return told, np.hstack(rows)


class _Columns:
    """Computes candidates' rows, at block rate where that is enough."""

    def __init__(self, prepared: Prepared, regression: DecisionRegression) -> None:
        self._regression, self._prepared = regression, prepared
        slow = [at_block_rate(run) for run in prepared.runs]
        baseline = prepared.baseline
        plain = [columns_under((), run, baseline)[0] for run in slow]
        self._runs = {False: slow, True: list(prepared.runs)}
        self._plain = {False: plain, True: list(prepared.columns)}

    def __call__(self, candidate: Candidate) -> NDArray | None:
        return self._rows(candidate, needs_full_rate(candidate.effect))

    def at_block_rate(self, candidate: Candidate) -> NDArray | None:
        """Compute rows at block rate, near enough to choose where to look."""
        return self._rows(candidate, False)

    def _rows(self, candidate: Candidate, full: bool) -> NDArray | None:
        runs, plain = self._runs[full], self._plain[full]
        prepared = self._prepared
        parts = signatures(candidate, runs, prepared.baseline, plain, prepared.weights)
        own = candidate.columns_in([run.motion.run for run in runs])
        wide = [own.expand(part, r) for r, part in enumerate(parts)]
        if not all(np.isfinite(part).all() for part in wide):
            return None
        return self._regression.rows(wide)
