"""Compute the columns that torque effects add to the baseline's, for each measured torque."""

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.evidence.observed_run import Run


def torque_columns(candidate: Candidate, number: int, run: Run) -> NDArray:
    """Return a torque effect's columns in one run, for drives, then for cuffs.

    The cuffs' columns are zero where the person does not carry the effect.

    Parameters
    ----------
    candidate : Candidate
    number : int
        Number of the run.
    run : Run

    Returns
    -------
    (m, O, k) array
        N·m per unit of each linear parameter.
    """
    # The same as Model.regressor of one plain term, but faster: it is called thousands of times.
    columns = candidate.effect.columns(run.motion, candidate.shapes[number])
    cuffs = candidate.effect.cuff_columns(run.motion, columns)
    cuffs = np.zeros_like(columns) if cuffs is None else cuffs
    return run.average(np.concatenate([columns, cuffs], axis=1))
