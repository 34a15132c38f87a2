"""Compute the columns that candidates add to the baseline's, for each measured torque.

Torque effects have columns of their own. Effects that change kinematics or readings are not linear:
the baseline is computed again from the transformed motion and refitted. The column is its
difference from the untouched baseline under the same parameters. Linearised at biased parameters,
elasticity would be mistaken for an encoder offset.
"""

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.evidence.observed_run import Run


def bent_column(
    columns: NDArray, measured: NDArray, values: NDArray, untouched: NDArray, run: Run
) -> NDArray:
    """Return the change of torque from the untouched to the transformed baseline, (m, O, 1) N·m.

    Parameters
    ----------
    columns : (m, O, b) array
        Columns of the transformed baseline.
    measured : (m, O) array
        Torque measured under the transformed motion, N·m.
    values : (b,) array
        Values of the baseline.
    untouched : (m, O, b) array
        Columns of the plain baseline.
    run : Run
    """
    plain = untouched @ values[: untouched.shape[2]]
    return (columns @ values - plain - (measured - run.measured))[:, :, np.newaxis]


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
