"""Run the whole diagnosis: recordings in, a result out, in five steps.

1. *Training data*: the filtered runs, with faults of acquisition marked.
2. *Library*: every cause and every unlisted law as columns of one regression.
3. *Posterior*: the probability of each set of causes and laws.
4. *Fit*: the named causes with the baseline, their shapes refined.
5. *Validation*: errors and gains on data that no fit has seen.

``select`` does steps 2 and 3, ``judged_fit`` 4 and 5. Where further lines stand out behind named
causes, both are repeated with them. Where the error of step 5 is above the noise, both are repeated
with causes sought on all runs.
"""

from collections.abc import Sequence

from pipelines.contracts.fault_kind import FaultKind
from pipelines.diagnosis.all_runs import by_all_runs
from pipelines.diagnosis.candidates.library import Report, silent
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.evidence.prepared_runs import prepare
from pipelines.diagnosis.fit.validation_scheme import HoldOut
from pipelines.diagnosis.judged_fit import judged_fit
from pipelines.diagnosis.lines_behind import with_lines_behind
from pipelines.diagnosis.selection.selection import nothing_selected, select
from pipelines.diagnosis.training_data import training_data
from pipelines.mechanics.motion import Motion


def diagnose(
    motions: Sequence[Motion],
    report: Report = silent,
    known: Sequence[str] = (),
    accept: Sequence[FaultKind] = (),
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
        Labels of effects that the machine is known to have, without rigid body and friction.
    accept : sequence of FaultKind, optional
        Kinds of faults of acquisition whose veto the user overrules.

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        Where there is no run to train or to validate on, or an effect in ``known`` cannot be part
        of the baseline.
    """
    data = training_data(motions, known, accept)
    prepared = prepare(data.train, data.baseline)
    selected = nothing_selected(prepared) if data.spoilt else select(prepared, report)
    # Position of the progress bar at which the fit begins.
    fit_share = 0.75
    report(fit_share, "fit")
    scheme = HoldOut.of(data.train, data.validate, data.baseline)
    judged = judged_fit(selected, scheme, prepared.noise)
    behind = with_lines_behind(prepared, judged)
    if behind is not prepared:
        judged = judged_fit(select(behind), scheme, prepared.noise)
    # An error above the noise may mean that the training runs alone show too little.
    if not data.spoilt and judged.after.leaves_more_than_noise:
        judged = by_all_runs(
            data,
            prepared.noise,
            judged,
            # Its shares lie between the fit and the end.
            lambda share, what: report(fit_share + (1.0 - fit_share) * share, what),
        )
    return Diagnosis.of(data, prepared.noise, judged)
