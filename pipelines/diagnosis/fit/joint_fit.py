"""Fit the extended model, baseline and causes together, at given shapes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import ALWAYS, NEVER, Candidate
from pipelines.diagnosis.evidence.baseline import Baseline, with_load
from pipelines.diagnosis.evidence.baseline_columns import columns_under, gram_of_runs
from pipelines.diagnosis.evidence.gram import Gram, error, solve
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.change_point import Onset
from pipelines.effects import Side
from pipelines.model import ParameterLayout, TermColumns


@dataclass(frozen=True)
class Fit:
    """A set of causes fitted to some runs."""

    causes: tuple[Candidate, ...]
    values: NDArray
    """(size + linear parameters of the causes,)."""
    weights: NDArray
    """(O,) inverse variances under this fit."""
    rms: NDArray
    """(O,) N·m on the fitted samples."""
    cost: float
    """Sum over outputs of samples times log rms, which refinement minimises."""
    layout: ParameterLayout
    """Of the values: the baseline's terms, then the causes."""
    loads: NDArray | None = None
    """Values (size + ...,) from whose bodies the joint loads were computed again; None if
    unchanged."""

    def instead(self, number: int, cause: Candidate) -> list[Candidate]:
        """Return the causes with one replaced by another."""
        return [cause if k == number else c for k, c in enumerate(self.causes)]

    def columns_of(self, number: int) -> TermColumns:
        """Return the columns of a cause in ``values``, and the runs in which it acts."""
        return self.layout.terms[len(self.layout.terms) - len(self.causes) + number]


def fit(
    causes: Sequence[Candidate],
    runs: Sequence[Run],
    baseline: Baseline,
    weights: NDArray,
    loads: NDArray | None = None,
) -> Fit:
    """Fit baseline and causes at their shapes.

    Parameters
    ----------
    causes : sequence of Candidate
    runs : sequence of Run
        With joint loads computed from ``loads``.
    baseline : Baseline
    weights : (O,) array
        The outputs' inverse variances, 1/(N·m)².
    loads : array, optional
        As of ``Fit.loads``.

    Returns
    -------
    Fit
    """
    # Sensors come last.
    causes = tuple(sorted(causes, key=lambda cause: cause.effect.side is Side.SENSOR))
    gram = gram_of_runs(runs, *zip(*stacked_columns(causes, runs, baseline), strict=True))
    values = solve(gram, weights)
    errors, rms, cost = _errors(gram, values)
    return Fit(causes, values, errors, rms, cost, _layout(causes, runs, baseline), loads)


def with_loads_of(runs: Sequence[Run], fitted: Fit, baseline: Baseline) -> list[Run]:
    """Return runs with the joint loads of a fit."""
    return (
        list(runs)
        if fitted.loads is None
        else [with_load(run, baseline, fitted.loads) for run in runs]
    )


def residuals_on(fitted: Fit, runs: Sequence[Run], baseline: Baseline) -> list[NDArray]:
    """Return a fit's residuals on each run that it was fitted to.

    Parameters
    ----------
    fitted : Fit
        Causes and their values.
    runs : sequence of Run
        The runs of the fit, m blocks each.
    baseline : Baseline
        The fit's baseline.

    Returns
    -------
    list of (m, O) arrays
        N·m.
    """
    columns = stacked_columns(fitted.causes, with_loads_of(runs, fitted, baseline), baseline)
    return [measured - c @ fitted.values for c, measured in columns]


def _layout(
    causes: Sequence[Candidate], runs: Sequence[Run], baseline: Baseline
) -> ParameterLayout:
    """Return the layout of the columns of baseline and causes in runs."""
    effects = (*baseline.effects, *(cause.effect for cause in causes))
    return ParameterLayout.of(effects, [run.motion.run for run in runs])


def stacked_columns(
    causes: Sequence[Candidate], runs: Sequence[Run], baseline: Baseline
) -> list[tuple[NDArray, NDArray]]:
    """Return the columns of baseline and causes in each run, and its measured torque.

    Per-run parameters have columns of their own.

    Parameters
    ----------
    causes : sequence of Candidate
    runs : sequence of Run
    baseline : Baseline

    Returns
    -------
    list of ((m, O, c) array, (m, O) array)
        Columns, N·m per unit, and torque, N·m.
    """
    layout = _layout(causes, runs, baseline)
    of_runs = (
        columns_under([c.term(r) for c in causes], run, baseline) for r, run in enumerate(runs)
    )
    return [(layout.expand(columns, r), measured) for r, (columns, measured) in enumerate(of_runs)]


def _errors(gram: Gram, values: NDArray) -> tuple[NDArray, NDArray, float]:
    count = gram.count
    there = count > 0
    squares = error(gram, values)
    rms = np.sqrt(squares / np.maximum(count, 1))
    weights = np.where(there, 1.0 / np.maximum(rms, 1e-6) ** 2, 0.0)
    # The cost is minus the log likelihood with each variance at its estimate, up to a constant.
    return weights, rms, float(np.sum(count[there] * np.log(rms[there])))


def onsets_of(
    fitted: Fit, number: int, i: int, runs: Sequence[Run], baseline: Baseline
) -> list[Onset]:
    """Return for each run when a cause may begin, all else held.

    Parameters
    ----------
    fitted : Fit
        Causes and their values.
    number : int
        Number of the cause.
    i : int
        Number of its shape that is the onset.
    runs : sequence of Run
        The runs of the fit.
    baseline : Baseline
        The fit's baseline.
    """
    # The two extremes suffice: an onset in between is made of both.
    ends = [
        fitted.instead(number, fitted.causes[number].reshaped(i, end)) for end in (NEVER, ALWAYS)
    ]
    without, throughout = (
        [
            measured - columns @ fitted.values
            for columns, measured in stacked_columns(causes, runs, baseline)
        ]
        for causes in ends
    )
    return [
        Onset.of(run, never, always, run.usable, fitted.weights)
        for run, never, always in zip(runs, without, throughout, strict=True)
    ]


def slope(
    fitted: Fit,
    place: tuple[int, int, int],
    runs: Sequence[Run],
    baseline: Baseline,
    plain: Sequence[tuple[NDArray, NDArray]],
) -> list[NDArray]:
    """Return the change of the prediction by a shape, per unit of it, (m, O) of each run.

    Parameters
    ----------
    fitted : Fit
    place : (cause, shape parameter, run)
        Run -1 for all.
    runs : sequence of Run
    baseline : Baseline
    plain : sequence of ((m, O, c) array, (m, O) array)
        The fit's own columns and torques.
    """
    number, i, run = place
    cause = fitted.causes[number]
    step = step_of(cause, i, max(run, 0))
    moved = cause.moved(i, step, None if run < 0 else [run])
    ahead = stacked_columns(fitted.instead(number, moved), runs, baseline)
    # Readings change as well as predictions where a sensor or a link moves.
    return [
        ((c @ fitted.values - y) - (d @ fitted.values - z)) / step
        for (c, y), (d, z) in zip(ahead, plain, strict=True)
    ]


def step_of(cause: Candidate, i: int, run: int = 0) -> float:
    """Return the step of a difference along a shape parameter.

    Parameters
    ----------
    cause : Candidate
        The cause.
    i : int
        Number of the shape.
    run : int, optional
        Run whose value is the scale of a wide positive range.

    Returns
    -------
    float
        In the shape's unit.
    """
    low, high = cause.effect.shape[i].typical
    # Step of a difference along a shape parameter, as a share of its typical range.
    share = 0.01
    return share * (abs(cause.shapes[run][i]) if low > 0 and high / low > 4 else high - low)
