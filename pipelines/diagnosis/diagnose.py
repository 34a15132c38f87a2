"""Run the whole diagnosis: recordings in, a result out, in five steps.

1. *Training data*: the filtered runs, with faults of acquisition marked.
2. *Library*: every cause and every unlisted law as columns of one regression.
3. *Posterior*: the probability of each set of causes and laws.
4. *Fit*: the named causes with the baseline, their shapes refined.
5. *Validation*: errors and gains on data that no fit has seen. Where the error is above the noise,
   steps 2 to 5 are repeated with causes sought on all runs.
"""

from collections.abc import Sequence
from dataclasses import replace

from pipelines.diagnosis.candidates.library import silent
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.evidence.model_error import imperfection
from pipelines.diagnosis.evidence.noise_model import NoiseModel
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns, prepare
from pipelines.diagnosis.fit import parameter_rows
from pipelines.diagnosis.fit.presliding_test import built_up
from pipelines.diagnosis.fit.simulation_error import simulation_error
from pipelines.diagnosis.fit.uncertainty import uncertainty
from pipelines.diagnosis.fit.validation_scheme import CrossValidation, HoldOut
from pipelines.diagnosis.judged_fit import JudgedFit, judged_fit
from pipelines.diagnosis.selection.selection import Report, nothing_selected, select
from pipelines.diagnosis.training_data import TrainingData, training_data
from pipelines.mechanics.motion import Motion

FIT_SHARE = 0.75
"""Position of the progress bar at which the fit begins."""


def diagnose(
    motions: Sequence[Motion], report: Report = silent, known: Sequence[str] = ()
) -> Diagnosis:
    """Find where rigid body with Coulomb and viscous friction is wrong, and the cause.

    Causes are sought in, and fitted to, the ``train`` runs. The ``validate`` runs measure every
    error. They may lower the probability of a cause that does harm there, and decide between ties.
    Where the named causes leave an error above the noise there, causes are sought on all runs. If
    these causes, fitted to the ``train`` runs, do not predict the ``validate`` runs, they are
    cross-validated there.

    Parameters
    ----------
    motions : sequence of Motion
        Runs of one machine, some to train and some to validate.
    report : callable, optional
        Takes the share that is done, 0 to 1, and the present step.
    known : sequence of str, optional
        Labels of effects that the machine is known to have besides rigid body and friction.

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        Where there is no run to train or to validate on, or an effect in ``known`` cannot be part
        of the baseline.
    """
    data = training_data(motions, known)
    prepared = prepare(data.train, data.baseline)
    selected = nothing_selected(prepared) if data.spoilt else select(prepared, report)
    report(FIT_SHARE, "fit")
    judged = judged_fit(
        selected, HoldOut.of(data.train, data.validate, data.baseline), prepared.noise
    )
    # An error above the noise may mean that the training runs alone show too little.
    if not data.spoilt and judged.after.leaves_more_than_noise:
        judged = _by_all_runs(data, prepared, judged, report)
    return _diagnosis(data, prepared.noise, judged)


def _by_all_runs(
    data: TrainingData, prepared: PreparedRuns, judged: JudgedFit, report: Report
) -> JudgedFit:
    """Search all runs, and return that result where it improves on the training runs alone.

    Its causes are fitted to the training runs, and must predict the validation runs better. Where
    the training runs show something, all runs must name other listed causes, and leave nothing
    unlisted. Where they show nothing, they may not determine the sizes of the new causes either:
    these are then cross-validated. Where this fails too, the finding of all runs has no name.
    """
    first, noise = judged.selected, prepared.noise
    runs = (*data.train, *data.validate)
    searched = select(prepare(runs, data.baseline), _in_the_rest(report)).as_all_runs_search(first)
    by_all = judged_fit(searched, judged.scheme, noise)
    now = by_all.selected
    if now.answer.named and by_all.predicts_better_than(judged.after, noise):
        # The causes of the training runs again are no news: their error called for this search.
        others = now.names_all and now.answer.variants != first.answer.variants
        if others or not first.shows_something:
            return by_all
    if first.shows_something or not searched.shows_something:
        return judged
    if searched.answer.named:
        scheme = CrossValidation(data.train, data.validate, data.baseline)
        validated = judged_fit(searched, scheme, noise)
        if validated.selected.answer.named and validated.predicts_better_than(
            validated.before, noise
        ):
            return validated
    return replace(judged, selected=searched.without_names)


def _in_the_rest(report: Report) -> Report:
    """Return a report whose shares lie between the fit and the end."""
    return lambda share, what: report(FIT_SHARE + (1.0 - FIT_SHARE) * share, what)


def _diagnosis(data: TrainingData, noise: NoiseModel, judged: JudgedFit) -> Diagnosis:
    """Assemble the result: intervals, parameters, simulation errors, reversals."""
    baseline, before, after = data.baseline, judged.before, judged.after
    fitted, validate = judged.scheme.runs, before.runs
    known = uncertainty(after.fit, fitted, baseline, imperfection(fitted))
    parameters, covariance = parameter_rows.parameters(after.fit, baseline, known)
    drift = simulation_error(before.fit, validate, baseline)
    # Without named causes both models are the same.
    after_drift = drift if after is before else simulation_error(after.fit, validate, baseline)
    residuals = {"baseline": before.residuals, "extended": after.residuals}
    train = fitted[: len(data.train)]
    reversals = [] if data.spoilt else built_up(after.fit, baseline, train, validate)
    return Diagnosis(
        data,
        noise,
        judged.scheme,
        judged.selected,
        before,
        after,
        judged.without,
        after.floor,
        known,
        parameters,
        covariance,
        parameter_rows.residual_table(validate, residuals),
        tuple(reversals),
        {"baseline": drift, "extended": after_drift},
    )
