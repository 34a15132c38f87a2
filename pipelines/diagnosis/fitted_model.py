"""A fit as a model, as replays and control loops take it: the one that ``parameters.parquet`` tells of."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pipelines.diagnosis import tables
from pipelines.diagnosis.evaluate import settled
from pipelines.diagnosis.fit import Fit
from pipelines.diagnosis.observations import Baseline, Run
from pipelines.diagnosis.scan import NEVER
from pipelines.diagnosis.uncertainty import Uncertainty
from pipelines.model import Model, model_from_parameters


def fitted_model(made: Fit, baseline: Baseline, kind: str) -> Model:
    """Return a fit as the model of a kind of run; what each run has for itself is as in the first one fitted."""
    # Nobody asks how sure the values are.
    size = len(made.values)
    frame, _ = tables.parameters(made, baseline, Uncertainty(np.zeros((size, size)), 1.0, (), np.eye(size)))
    return model_from_parameters(frame, kind, baseline.machine)


def model_of_run(made: Fit, baseline: Baseline, run: Run) -> Model:
    """Return a fit as the model of one run, with the onsets and phases that it has for itself."""
    model = fitted_model(made, baseline, run.motion.run)
    if not any(cause.effect.per_run for cause in made.causes):
        return model
    own = {term.effect.label: term.values for term in settled(made, run, baseline)[0]}
    return Model(tuple(replace(t, values=own.get(t.effect.label, t.values)) for t in model))


def _or_null(value: float) -> float | None:
    """Return a value, or nothing for an instant outside every run: what never came, or was there all along."""
    return None if abs(value) >= NEVER else float(value)


def values_of_each_run(
    made: Fit, baseline: Baseline, train: Sequence[Run], validate: Sequence[Run]
) -> dict[str, list[dict[str, Any]]]:
    """Return what each run has for itself of the causes that have such values, by label, as ``verdict.json`` tells.

    Shapes of the runs that were trained on are the fit's own.
    """
    told: dict[str, list[dict[str, Any]]] = {c.label: [] for c in made.causes if c.effect.per_run}
    fitted = {(cause.label, r): shape for cause in made.causes for r, shape in enumerate(cause.shapes)}
    for r, run in enumerate((*train, *validate) if told else ()):
        for term in settled(made, run, baseline)[0]:
            effect, motion = term.effect, run.motion
            shape = fitted[effect.label, r] if r < len(train) else term.shape
            values = effect.physical(np.append(term.linear, shape))
            own = {p.name: _or_null(v) for p, v in zip(effect.parameters, values, strict=True) if p.per_run}
            if own and effect.explains(motion):
                told[effect.label].append({"file": motion.file, "purpose": motion.purpose, "values": own})
    return told
