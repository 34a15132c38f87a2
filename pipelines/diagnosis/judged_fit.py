"""The named causes fitted to the training runs, and judged on the validation runs."""

from pipelines.diagnosis.evidence.prepared_runs import Prepared
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.fit.validation import Validated, log_likelihood_ratio, without_each
from pipelines.diagnosis.selection.selected import Selected


def judged(
    selected: Selected, refine: Refinement, prepared: Prepared, before: Validated
) -> tuple[Selected, Validated, dict[str, Validated]]:
    """Return the causes that the validation runs leave named, fitted, and the same without each.

    The most harmful cause is dropped first and the rest fitted anew: beside it, what others do may
    seem to harm too.
    """
    while True:
        after, without = _fitted(selected, refine, prepared, before)
        # One run says nothing of a value that another run has for itself.
        shared = [c for c in selected.candidates if not (c.effect.each_run or any(p.per_run for p in c.effect.linear))]
        ratios = {c.label: log_likelihood_ratio(without[c.label], after, prepared.noise) for c in shared}
        kept = selected.judged(ratios)
        still = {one.element.label for one in kept.answer.named if not one.element.each_run}
        harmful = ratios.keys() - still
        if not harmful:
            return kept, after, without
        worst = min(harmful, key=lambda label: ratios[label])
        selected = selected.judged({worst: ratios[worst]})


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
