"""The named causes fitted to the training runs, and judged on the validation runs."""

import numpy as np

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.prepared_runs import Prepared
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.fit.validation import (
    Validated,
    log_likelihood_ratio,
    log_likelihoods,
    without_each,
)
from pipelines.diagnosis.selection.marginal_likelihood import power
from pipelines.diagnosis.selection.selected import Selected


def judged(
    selected: Selected, refine: Refinement, prepared: Prepared, before: Validated
) -> tuple[Selected, Validated, dict[str, Validated]]:
    """Return the causes that training and validation runs leave named, fitted, and the same without each.

    The most harmful cause is charged first: beside it, what others do may seem to harm too. Of causes
    that the training runs cannot tell apart, those are charged that predict the validation runs worse
    than the best of them.
    """
    fitted: tuple[Candidate, ...] | None = None
    while True:
        if selected.candidates != fitted:
            fitted = selected.candidates
            after, without = _fitted(selected, refine, prepared, before)
        # One run says nothing of a value that another run has for itself.
        shared = [c.label for c in fitted if not c.effect.sized_each_run]
        ratios = {label: log_likelihood_ratio(without[label], after, prepared.noise) for label in shared}
        harm = [charge for label, ratio in ratios.items() if (charge := selected.harm_of(label, ratio))]
        if harm:
            selected = selected.judged(min(harm, key=lambda charge: min(charge.values())), harms=True)
        elif losses := _losses(selected, after, refine, prepared, before):
            selected = selected.judged(losses)
        else:
            return selected, after, without


def _losses(
    selected: Selected, after: Validated, refine: Refinement, prepared: Prepared, before: Validated
) -> dict[str, float]:
    """Return by how much named causes and their ties predict the validation runs worse than the best of them.

    In log likelihood, by variant; of ties that were not compared yet.
    """
    losses: dict[str, float] = {}
    plain = log_likelihoods(before, prepared.noise)
    for n, one in enumerate(selected.answer.named):
        rest = selected.candidates[:n] + selected.candidates[n + 1 :]
        if not (rivals := selected.rivals_of(n)):
            continue
        told = {one.element.variant: log_likelihoods(after, prepared.noise)}
        for variant, rival in rivals.items():
            fitted = Validated.of(refine((*rest, rival)), before.runs, prepared.baseline)
            told[variant] = log_likelihoods(fitted, prepared.noise)
        gained = 2.0 * (max(told.values(), key=np.sum) - plain)
        counts = power(np.append(np.maximum(gained, 0.0), np.zeros_like(gained)), CRITERIA)[: len(gained)]
        scores = {variant: float(counts @ likelihood) for variant, likelihood in told.items()}
        losses |= {variant: score - max(scores.values()) for variant, score in scores.items()}
    return losses


def _fitted(
    selected: Selected, refine: Refinement, prepared: Prepared, before: Validated
) -> tuple[Validated, dict[str, Validated]]:
    """Return the named causes fitted, and the same without each of them, on the validation runs."""
    candidates = selected.candidates
    if not candidates:
        return before, {}
    baseline = prepared.baseline
    after = Validated.of(refine(candidates), before.runs, baseline)
    if len(candidates) == 1:
        return after, {candidates[0].label: before}
    without = without_each(after.fit, prepared.runs, before.runs, baseline, prepared.weights)
    return after, without
