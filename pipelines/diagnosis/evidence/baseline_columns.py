"""The columns of the baseline, and of terms beside it, behind the regression filter."""

from collections.abc import Sequence

from numpy.typing import NDArray

from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.gram import Gram, gram_of
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.model import Model, Term


def columns_under(terms: Sequence[Term], run: Run, baseline: Baseline) -> tuple[NDArray, NDArray]:
    """Return the columns of the baseline and of some terms in one run, and what was measured.

    Terms transform the motion that everything is computed at, add their own torque, and stand
    between torque and reading. The force sensors sit on the links: their forces make another
    torque where those stand at another angle.

    Returns
    -------
    (m, O, size + linear parameters) columns and (m, O) measured torques, N·m.
    """
    model = Model((*baseline.terms, *terms))
    motions = model.motions(run.motion)
    columns = model.regressor(run.motion, cuffs=True, motions=motions)
    return run.average(columns), run.measured_at(motions.link)


def gram_of_runs(
    runs: Sequence[Run], columns: Sequence[NDArray], measured: Sequence[NDArray] | None = None
) -> Gram:
    """Multiply out all runs; ``measured`` (m, O) each where it is not the runs' own."""
    measured = measured or [run.measured for run in runs]
    grams = [gram_of(c, y, r.usable) for r, c, y in zip(runs, columns, measured, strict=True)]
    total = grams[0]
    for gram in grams[1:]:
        total = total + gram
    return total
