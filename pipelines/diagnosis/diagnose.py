"""The whole diagnosis: recordings in, a result out, in five steps.

1. *Training data*: the runs behind their filters; faults of acquisition are marked.
2. *Library*: every cause and every unlisted law as columns of one regression.
3. *Posterior*: how probable each set of causes and laws is.
4. *Fit*: the named causes with the baseline, their shapes refined.
5. *Validation*: errors and gains on runs that no fit has seen.
"""

from collections.abc import Callable, Sequence

from pipelines.diagnosis.candidates.auxiliary_evidence import auxiliary_evidence
from pipelines.diagnosis.candidates.library import Library, build_library, silent
from pipelines.diagnosis.diagnosis import Diagnosis, Selected
from pipelines.diagnosis.evidence.baseline import like_trained, with_load
from pipelines.diagnosis.evidence.model_error import imperfection
from pipelines.diagnosis.evidence.noise_floor import noise_floor
from pipelines.diagnosis.evidence.prepared_runs import Prepared, prepare
from pipelines.diagnosis.evidence.residual_shares import ResidualShares, residual_shares
from pipelines.diagnosis.fit import parameter_rows
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.fit.presliding_test import built_up
from pipelines.diagnosis.fit.simulation_error import simulation_error
from pipelines.diagnosis.fit.uncertainty import uncertainty
from pipelines.diagnosis.fit.validation import Validated, log_likelihood_ratio, without_each
from pipelines.diagnosis.selection.answer import Answer, answer_of
from pipelines.diagnosis.selection.evidence import Evidence
from pipelines.diagnosis.selection.findings import findings
from pipelines.diagnosis.selection.posterior import (
    Posterior,
    likely_contexts,
    posterior,
    strongest,
)
from pipelines.diagnosis.training_data import TrainingData, training_data
from pipelines.mechanics.motion import Motion

LIBRARY_SHARE, FIT_SHARE = 0.6, 0.75
"""Of the progress bar, where the library and the posterior are done."""
PARTNERS = 5
"""Causes that are refined beside a strong one."""
Report = Callable[[float, str], None]


def diagnose(motions: Sequence[Motion], report: Report = silent, known: Sequence[str] = ()) -> Diagnosis:
    """Find what the rigid body with Coulomb and viscous friction gets wrong, and why.

    Selection, shapes and shared parameters use ``train`` runs only. The ``validate`` runs measure
    every error, and may lower the probability of a cause that does harm there.

    Parameters
    ----------
    motions : sequence of Motion
        Runs of one machine, some to train and some to validate.
    report : callable, optional
        Takes the share that is done, 0 to 1, and what is being done.
    known : sequence of str, optional
        Labels of what the machine is known to have besides rigid body and friction.

    Raises
    ------
    InputError
        Where there is no run to train or to validate on, or no baseline can have what is ``known``.
    """
    data = training_data(motions, known)
    prepared = prepare(data.train, data.baseline)
    selected = nothing_selected(prepared) if data.spoilt else select(prepared, report)
    report(FIT_SHARE, "fit")
    return _validated(data, prepared, selected)


def evidence_of(motions: Sequence[Motion], known: Sequence[str] = ()) -> Evidence:
    """Return what the decision needs of a session."""
    data = training_data(motions, known)
    prepared = prepare(data.train, data.baseline)
    return _weighed(prepared, silent)[1]


def select(prepared: Prepared, report: Report = silent) -> Selected:
    """Weigh all sets of causes and laws, and read the answer off the posterior."""
    library, evidence, weighed = _weighed(prepared, report)
    answer = answer_of(weighed)
    found = tuple(findings(weighed, answer))
    return Selected(library, evidence, weighed, answer, found, _router(prepared))


def nothing_selected(prepared: Prepared) -> Selected:
    """Return the answer where faults of acquisition keep physics from being looked at."""
    return Selected(None, None, None, Answer((), 0.0, 0.0), (), _router(prepared))


def _weighed(prepared: Prepared, report: Report) -> tuple[Library, Evidence, Posterior]:
    """Return the library, its evidence, and how probable each set is.

    Causes are refined alone first, then beside the others of likely sets.
    """
    library = build_library(prepared, lambda share, what: report(LIBRARY_SHARE * share, what))
    report(LIBRARY_SHARE, "posterior")
    auxiliary = auxiliary_evidence(prepared)
    evidence = Evidence.of(library, auxiliary)
    weighed = posterior(evidence)
    refined = library
    for number in strongest(weighed):
        refined = refined.with_partners(number, PARTNERS)
    refined = refined.refined_together(likely_contexts(weighed))
    if refined is library:
        return library, evidence, weighed
    evidence = Evidence.of(refined, auxiliary)
    return refined, evidence, posterior(evidence)


def _router(prepared: Prepared) -> tuple[ResidualShares, ...]:
    return tuple(residual_shares(prepared.runs, prepared.residuals, prepared.noise))


def _validated(data: TrainingData, prepared: Prepared, selected: Selected) -> Diagnosis:
    """Fit what is named and measure it on the validation runs."""
    baseline, weights = data.baseline, prepared.weights
    refine = Refinement(prepared.runs, baseline, weights)
    validate = tuple(with_load(like_trained(run, baseline), baseline, prepared.values) for run in data.validate)
    before = Validated.of(refine(()), validate, baseline)
    selected, after, without = _judged(selected, refine, prepared, before)
    known = uncertainty(after.fit, prepared.runs, baseline, imperfection(prepared.runs))
    parameters, covariance = parameter_rows.parameters(after.fit, baseline, known)
    drift = simulation_error(before.fit, validate, baseline)
    after_drift = drift if after is before else simulation_error(after.fit, validate, baseline)
    residuals = {"baseline": before.residuals, "extended": after.residuals}
    reversals = [] if data.spoilt else built_up(after.fit, baseline, prepared.runs, validate)
    return Diagnosis(
        data, selected, before, after, without, noise_floor(validate, after.residuals), known,
        parameters, covariance, parameter_rows.residual_table(validate, residuals), tuple(reversals),
        {"baseline": drift, "extended": after_drift},
    )  # fmt: skip


def _judged(
    selected: Selected, refine: Refinement, prepared: Prepared, before: Validated
) -> tuple[Selected, Validated, dict[str, Validated]]:
    """Return the causes that the validation runs leave named, fitted, and the same without each.

    The most harmful cause is dropped first and the rest fitted anew: beside it, what others do may
    seem to harm too.
    """
    while True:
        after, without = _fitted(selected, refine, prepared, before)
        # A torque whose size each run has for itself says nothing of another run.
        shared = {c.label for c in selected.candidates if not any(p.per_run for p in c.effect.linear)}
        ratios = {
            label: log_likelihood_ratio(less, after, prepared.noise)
            for label, less in without.items()
            if label in shared
        }
        judged = selected.judged(ratios)
        harmful = ratios.keys() - {one.element.label for one in judged.answer.named}
        if not harmful:
            return judged, after, without
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
