"""Seek causes on all runs, where those of the training runs leave an error above the noise."""

from dataclasses import replace

from pipelines.diagnosis.candidates.library import Report
from pipelines.diagnosis.evidence.noise_model import NoiseModel
from pipelines.diagnosis.evidence.prepared_runs import prepare
from pipelines.diagnosis.fit.validation_scheme import CrossValidation
from pipelines.diagnosis.judged_fit import JudgedFit, judged_fit
from pipelines.diagnosis.lines_behind import with_lines_behind
from pipelines.diagnosis.selection.selection import select
from pipelines.diagnosis.training_data import TrainingData


def by_all_runs(
    data: TrainingData, noise: NoiseModel, judged: JudgedFit, report: Report
) -> JudgedFit:
    """Search all runs, and return that result where it improves on the training runs alone.

    Its causes are fitted to the training runs, and must predict the validation runs better. Where
    the training runs show something, all runs must name other listed causes, and leave nothing
    unlisted. Where they show nothing, they may not determine the sizes of the new causes either:
    these are then cross-validated. Where this fails too, the finding of all runs has no name.

    Parameters
    ----------
    data : TrainingData
    noise : NoiseModel
        Of the training runs.
    judged : JudgedFit
        The result of the training runs alone.
    report : callable
        Takes the share that is done, 0 to 1, and the present step.
    """
    first = judged.selected
    runs = (*data.train, *data.validate)
    prepared = with_lines_behind(prepare(runs, data.baseline), judged)
    searched = select(prepared, report).as_all_runs_search(first)
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
