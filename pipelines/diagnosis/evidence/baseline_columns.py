"""Compute the columns of the baseline, and of other terms, behind the regression filter."""

from collections.abc import Sequence

from numpy.typing import NDArray

from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.gram import Gram, gram_of
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.model import Model, Term


def columns_under(terms: Sequence[Term], run: Run, baseline: Baseline) -> tuple[NDArray, NDArray]:
    """Return the columns of the baseline and of some terms in one run, and the torque.

    Terms transform the motion at which everything is computed, add their own torque, and act
    between torque and reading. The force sensors are on the links: if a link is at another angle,
    their forces make another torque.

    Parameters
    ----------
    terms : sequence of Term
    run : Run
    baseline : Baseline

    Returns
    -------
    (m, O, size + linear parameters) array
        Columns.
    (m, O) array
        Measured torques, N·m.
    """
    model = Model((*baseline.terms, *terms))
    motions = model.motions(run.motion)
    columns = model.regressor(run.motion, cuffs=True, motions=motions)
    return run.average(columns), run.measured_at(motions.link)


def gram_of_runs(
    runs: Sequence[Run], columns: Sequence[NDArray], measured: Sequence[NDArray] | None = None
) -> Gram:
    """Return the Gram matrices of all runs.

    Parameters
    ----------
    runs : sequence of Run
    columns : sequence of (m, O, c) arrays
    measured : sequence of (m, O) arrays, optional
        N·m, where it differs from the runs' own.
    """
    measured = measured or [run.measured for run in runs]
    grams = [gram_of(c, y, r.usable) for r, c, y in zip(runs, columns, measured, strict=True)]
    return sum(grams[1:], start=grams[0])
