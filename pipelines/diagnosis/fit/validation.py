"""A model on the validation runs, which no fit has seen, and what that says of its causes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.decision_band import LENGTH_S, DecisionBand
from pipelines.diagnosis.evidence.noise_model import NoiseModel
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.held_out import evaluate
from pipelines.diagnosis.fit.joint_fit import Fit, fit, laden
from pipelines.diagnosis.fit.validation_error import Errors, Gain, errors_of, gain


@dataclass(frozen=True)
class Validated:
    """A fitted model and what it leaves of the validation runs."""

    fit: Fit
    runs: Sequence[Run]
    residuals: tuple[NDArray, ...]
    """(m, O) N·m of each run."""
    errors: Errors

    @classmethod
    def of(cls, made: Fit, validate: Sequence[Run], baseline: Baseline) -> "Validated":
        """Evaluate a fit on the validation runs."""
        residuals = tuple(evaluate(made, validate, baseline))
        return cls(made, validate, residuals, errors_of(validate, residuals))


def without_each(
    made: Fit, train: Sequence[Run], validate: Sequence[Run], baseline: Baseline, weights: NDArray
) -> dict[str, Validated]:
    """Return the model without each of its causes, the others kept and fitted anew under the same loads, by label.

    Parameters
    ----------
    weights : NDArray
        (O,) inverse variances of the outputs, 1/(N·m)².
    """
    found, runs = {}, laden(train, made, baseline)
    for label in dict.fromkeys(cause.label for cause in made.causes):
        rest = [cause for cause in made.causes if cause.label != label]
        found[label] = Validated.of(fit(rest, runs, baseline, weights, made.loads), validate, baseline)
    return found


def gains_of(without: Mapping[str, Validated], whole: Validated) -> dict[str, Gain]:
    """Return what each cause gains beside the others, by label."""
    return {label: gain(less.errors, whole.errors) for label, less in without.items()}


def log_likelihood_ratio(without: Validated, whole: Validated, noise: NoiseModel) -> float:
    """Return the log likelihood of the validation runs with a cause over that without it.

    In the decision band, of rows of drives, under the noise that the training runs have.
    """
    sigma = noise.sigma(LENGTH_S)
    total = 0.0
    pairs = zip(whole.runs, without.residuals, whole.residuals, strict=True)
    for run, before, after in pairs:
        band = DecisionBand.of(run)
        joints = len(run.motion.joints)
        known = np.isfinite(sigma[:joints])
        fall = band.average(before) ** 2 - band.average(after) ** 2
        weighed = band.weight[:, :joints][:, known] * fall[:, :joints][:, known]
        total += 0.5 * float(np.sum(weighed / sigma[:joints][known] ** 2))
    return total
