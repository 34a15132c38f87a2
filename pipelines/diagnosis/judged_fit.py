"""Fit the named causes, and judge them on the validation runs."""

from dataclasses import dataclass

import numpy as np

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.noise_model import NoiseModel
from pipelines.diagnosis.fit.validation import ValidationResult, log_likelihoods, removed_share
from pipelines.diagnosis.fit.validation_error import gain
from pipelines.diagnosis.fit.validation_scheme import ValidationScheme
from pipelines.diagnosis.selection.marginal_likelihood import power
from pipelines.diagnosis.selection.selection import Selection


@dataclass(frozen=True)
class JudgedFit:
    """The named causes after judging, and their fit."""

    selected: Selection
    scheme: ValidationScheme
    """Which samples it is fitted to, and which score it."""
    before: ValidationResult
    """The baseline."""
    after: ValidationResult
    """The baseline with the named causes."""
    without: dict[str, ValidationResult]
    """The named causes less one, by that cause's label."""

    def predicts_better_than(self, other: ValidationResult, noise: NoiseModel) -> bool:
        """Return whether it predicts the validation runs significantly better than another model.

        Parameters
        ----------
        other : ValidationResult
            Scored on the same samples.
        noise : NoiseModel
            Of the training runs.
        """
        gained = log_likelihoods(self.after, noise) - log_likelihoods(other, noise)
        return (
            float(gained.sum()) > CRITERIA.predicted_better
            and gain(other.errors, self.after.errors).low > 0.0
        )


def judged_fit(selected: Selection, scheme: ValidationScheme, noise: NoiseModel) -> JudgedFit:
    """Fit the named causes, and judge them on the validation runs until no charge remains.

    The most harmful cause is charged first: in a model with it, other causes may seem to harm too.
    Of causes that the searched runs cannot separate, those that predict the validation runs worse
    than the best of them are charged. Last, each named cause is tested for being the look-alike of
    an effect that is not listed. Those that remain are fitted again, and not judged again.

    Parameters
    ----------
    selected : Selection
    scheme : ValidationScheme
        Which samples causes are fitted to, and which score them.
    noise : NoiseModel
        Of the training runs.
    """
    before, fitted = scheme.validated(()), None
    while True:
        # A charge may change probabilities only, and then the fits stand.
        if selected.candidates != fitted:
            fitted = selected.candidates
            after, without = _fitted(fitted, scheme, before)
            whole = log_likelihoods(after, noise)
            ratios = {
                label: float(np.sum(whole - log_likelihoods(less, noise)))
                for label, less in without.items()
            }
        harm = selected.worst_harm(ratios)
        if harm:
            selected = selected.judged(harm, harms=True)
        elif shortfalls := _shortfalls(selected, after, scheme, before, noise):
            selected = selected.judged(shortfalls)
        else:
            break
    # Last, because the share that a cause removes depends on the others that stay.
    shares = {label: removed_share(less, after) for label, less in without.items()}
    # A cause has no share if the error without it is at the noise floor.
    selected = selected.with_look_alikes(
        {label: share for label, share in shares.items() if share is not None}
    )
    if selected.candidates != fitted:
        after, without = _fitted(selected.candidates, scheme, before)
    return JudgedFit(selected, scheme, before, after, without)


def _shortfalls(
    selected: Selection,
    after: ValidationResult,
    scheme: ValidationScheme,
    before: ValidationResult,
    noise: NoiseModel,
) -> dict[str, float]:
    """Return by how much each tie predicts the validation runs worse than the best of its group.

    Log likelihoods, by variant; of groups that were not compared yet.
    """
    shortfalls: dict[str, float] = {}
    for n, one in enumerate(selected.answer.named):
        rest = selected.candidates[:n] + selected.candidates[n + 1 :]
        rivals = selected.rivals_of(n)
        if not rivals:
            continue
        likelihoods = {one.element.variant: log_likelihoods(after, noise)}
        for variant, rival in rivals.items():
            likelihoods[variant] = log_likelihoods(scheme.validated((*rest, rival)), noise)
        # Twice a log likelihood ratio is the explained square in units of the noise.
        explained = 2.0 * (max(likelihoods.values(), key=np.sum) - log_likelihoods(before, noise))
        weights = power(np.maximum(explained, 0.0), CRITERIA.drive_weight, CRITERIA.model_error)
        scores = {
            variant: float(weights @ likelihood) for variant, likelihood in likelihoods.items()
        }
        for variant, score in scores.items():
            shortfall = score - max(scores.values())
            # A variant may be a tie of two causes; its better comparison counts.
            shortfalls[variant] = max(shortfalls.get(variant, -np.inf), shortfall)
    return shortfalls


def _fitted(
    candidates: tuple[Candidate, ...], scheme: ValidationScheme, before: ValidationResult
) -> tuple[ValidationResult, dict[str, ValidationResult]]:
    """Fit causes, and the same without each of them, and score each fit."""
    if not candidates:
        return before, {}
    after = scheme.validated(candidates)
    labels = list(dict.fromkeys(cause.label for cause in after.fit.causes))
    # One cause less one is the baseline, which is fitted already.
    if len(candidates) == 1:
        return after, {labels[0]: before}
    return after, {one: scheme.refitted(after, {*labels} - {one}) for one in labels}
