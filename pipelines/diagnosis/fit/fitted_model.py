"""Return a fit as a model for replays and control loops, the same as ``parameters.parquet``."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import ALWAYS, NEVER
from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit import parameter_rows
from pipelines.diagnosis.fit.held_out import terms_with_own_values
from pipelines.diagnosis.fit.joint_fit import Fit
from pipelines.diagnosis.fit.uncertainty import Uncertainty
from pipelines.effects import Effect
from pipelines.model import Model, model_from_parameters


def fitted_model(fit: Fit, baseline: Baseline, kind: str) -> Model:
    """Return a fit as the model of a kind of run.

    Per-run values are those of the first run fitted.
    """
    # The intervals of these rows are not used, so any covariance will do.
    size = len(fit.values)
    frame, _ = parameter_rows.parameters(
        fit, baseline, Uncertainty(np.zeros((size, size)), 1.0, (), np.eye(size))
    )
    return model_from_parameters(frame, kind, baseline.machine)


def model_of_run(fit: Fit, baseline: Baseline, run: Run) -> Model:
    """Return a fit as the model of one run, with its own onsets and phases."""
    model = fitted_model(fit, baseline, run.motion.run)
    if not any(cause.effect.per_run for cause in fit.causes):
        return model
    # The table's per-run values are of another run, so they are fitted to this one.
    own = {term.effect.label: term.values for term in terms_with_own_values(fit, run, baseline)}
    return Model(tuple(replace(t, values=own.get(t.effect.label, t.values)) for t in model))


def values_of_each_run(
    fit: Fit, baseline: Baseline, sure: Uncertainty, fitted: Sequence[Run], others: Sequence[Run]
) -> dict[str, list[dict[str, Any]]]:
    """Return the per-run values of causes, by label, as entries of ``verdict.json``.

    Those of the fitted runs are the fit's own, with its intervals. Those of the others are fitted
    to their runs, all else held, and have none.

    Parameters
    ----------
    fit : Fit
    baseline : Baseline
    sure : Uncertainty
        Of the fit.
    fitted, others : sequences of Run
    """
    values_of: dict[str, list[dict[str, Any]]] = {
        c.label: [] for c in fit.causes if c.effect.per_run
    }
    for number, cause in enumerate(fit.causes):
        for r in fit.columns_of(number).runs if cause.label in values_of else ():
            values_of[cause.label].append(
                _stated_values(
                    cause.effect, fitted[r], *parameter_rows.values_in_run(fit, sure, number, r)
                )
            )
    for run in others if values_of else ():
        for term in terms_with_own_values(fit, run, baseline):
            if term.effect.label in values_of and term.effect.explains(run.motion):
                values_of[term.effect.label].append(
                    _stated_values(term.effect, run, term.effect.physical(term.values))
                )
    return values_of


def _stated_values(
    effect: Effect, run: Run, values: NDArray, ends: NDArray | None = None
) -> dict[str, Any]:
    """Return a run's own values (p,), and the ends (p, 2) of their intervals, as JSON objects.

    An effect that never began has no value; one that was always present began at zero.
    """
    own = {p.name: i for i, p in enumerate(effect.parameters) if p.per_run}
    came, values = values < NEVER, np.where(values <= ALWAYS, 0.0, values)
    return {
        "file": run.motion.file,
        "purpose": run.motion.purpose,
        "values": {name: float(values[i]) if came[i] else None for name, i in own.items()},
        "ci95": {
            name: ends[i].tolist() if ends is not None and came[i] else None
            for name, i in own.items()
        },
    }
