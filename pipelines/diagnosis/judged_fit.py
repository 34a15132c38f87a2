"""The named causes fitted to the training runs, and judged on the validation runs."""

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.evidence.prepared_runs import Prepared
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.fit.validation import Validated, log_likelihood_ratio, without_each
from pipelines.diagnosis.selection.selected import Selected


def judged(
    selected: Selected, refine: Refinement, prepared: Prepared, before: Validated
) -> tuple[Selected, Validated, dict[str, Validated]]:
    """Return the causes that training and validation runs leave named, fitted, and the same without each.

    The most harmful cause is charged first: beside it, what others do may seem to harm too. What
    takes its place is fitted and judged as well.
    """
    fitted: tuple[Candidate, ...] | None = None
    while True:
        if selected.candidates != fitted:
            fitted = selected.candidates
            after, without = _fitted(selected, refine, prepared, before)
        # One run says nothing of a value that another run has for itself.
        shared = [c.label for c in fitted if not (c.effect.each_run or any(p.per_run for p in c.effect.linear))]
        ratios = {label: log_likelihood_ratio(without[label], after, prepared.noise) for label in shared}
        charges = [charge for label, ratio in ratios.items() if (charge := selected.charges_of(label, ratio))]
        if not charges:
            return selected, after, without
        selected = selected.judged(min(charges, key=lambda charge: min(charge.values())))


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
