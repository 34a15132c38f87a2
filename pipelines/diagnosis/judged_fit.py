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
        # A torque whose size each run has for itself says nothing of another run.
        named = zip(selected.answer.named, selected.candidates, strict=True)
        shared = [one.element for one, cause in named if not any(p.per_run for p in cause.effect.linear)]
        ratios = {e.variant: log_likelihood_ratio(without[e.label], after, prepared.noise) for e in shared}
        kept = selected.judged(ratios)
        harmful = ratios.keys() - {one.element.variant for one in kept.answer.named}
        if not harmful:
            return kept, after, without
        worst = min(harmful, key=lambda variant: ratios[variant])
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
