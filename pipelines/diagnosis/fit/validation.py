"""Evaluate a model on samples that its fit has not seen, and judge its causes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.decision_band import LENGTH_S, DecisionBand
from pipelines.diagnosis.evidence.noise_floor import Floor, noise_floor
from pipelines.diagnosis.evidence.noise_model import NoiseModel
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.held_out import held_out_residuals
from pipelines.diagnosis.fit.joint_fit import Fit
from pipelines.diagnosis.fit.validation_error import Errors, errors_of


@dataclass(frozen=True)
class ValidationResult:
    """A fitted model and its residuals on the validation runs."""

    fit: Fit
    runs: Sequence[Run]
    residuals: tuple[NDArray, ...]
    """(m, O) N·m of each run."""
    errors: Errors
    half_fits: tuple[Fit, ...] = ()
    """In cross-validation: the fits without the first, and the second half of these runs."""
    without_steps: tuple[NDArray, ...] | None = None
    """In cross-validation: residuals of the fit to all runs, (m, O) N·m of each. Those of the two
    other fits differ by a step where their halves meet."""

    @classmethod
    def of(cls, fit: Fit, validate: Sequence[Run], baseline: Baseline) -> "ValidationResult":
        """Evaluate a fit on the validation runs.

        Parameters
        ----------
        fit : Fit
            Causes fitted to the training runs.
        validate : sequence of Run
            The validation runs.
        baseline : Baseline
            The fit's baseline.
        """
        residuals = tuple(held_out_residuals(fit, validate, baseline))
        return cls(fit, validate, residuals, errors_of(validate, residuals))

    @cached_property
    def floor(self) -> Floor:
        """The noise floor of these runs."""
        # A step between two fits would count as noise.
        return noise_floor(self.runs, self.without_steps or self.residuals)

    @property
    def leaves_more_than_noise(self) -> bool:
        """Whether the error of some joint is above the noise floor."""
        return bool(self.above(self.floor).any())

    def above(self, floor: Floor) -> NDArray:
        """Return whether each joint's error is above a noise floor.

        Parameters
        ----------
        floor : Floor
            rms of each output, N·m.

        Returns
        -------
        (J,) bool array
            Of the drives.
        """
        return np.asarray(self.errors.rms > CRITERIA.at_floor * floor.rms[: len(self.errors.rms)])


def removed_share(less: ValidationResult, whole: ValidationResult) -> float | None:
    """Return the share of a joint's systematic mean square that a cause removes, 0 to 1.

    Parameters
    ----------
    less, whole : ValidationResult
        The model without the cause, and with it.

    Returns
    -------
    float or None
        At the joint where the cause gains most; None where the model without it is at the noise
        floor.
    """
    # Where the cause gains most: at other joints the share would be mostly noise.
    joint = less.errors.joint_of_largest_fall(whole.errors)
    floor, without, with_it = (
        float(rms[joint]) for rms in (whole.floor.rms, less.errors.rms, whole.errors.rms)
    )
    power = without**2 - floor**2
    return float(np.clip((without**2 - with_it**2) / power, 0.0, 1.0)) if power > 0.0 else None


def log_likelihoods(validated: ValidationResult, noise: NoiseModel) -> NDArray:
    """Return the log likelihood of the validation runs for each drive, up to a constant.

    It is computed in the decision band, under the noise of the training runs.

    Parameters
    ----------
    validated : ValidationResult
    noise : NoiseModel
        Of the training runs.

    Returns
    -------
    (J,) array
    """
    joints = len(validated.runs[0].motion.joints)
    # The effective deviation allows for correlation, so averages count as independent.
    sigma = noise.sigma(LENGTH_S)[:joints]
    known, total = np.isfinite(sigma), np.zeros(joints)
    for run, residual in zip(validated.runs, validated.residuals, strict=True):
        band = DecisionBand.of(run)
        squares = np.sum(band.weight[:, :joints] * band.average(residual)[:, :joints] ** 2, axis=0)
        total[known] -= 0.5 * squares[known] / sigma[known] ** 2
    return total
