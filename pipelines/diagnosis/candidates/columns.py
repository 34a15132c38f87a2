"""What candidates add to each measured torque, as columns beside the baseline's.

Torque effects give their own columns. Effects that change kinematics or readings are not linear:
the baseline is rebuilt as they would have it and refitted there. Its difference from the untouched
baseline under the same parameters is the column. Linearised at biased parameters, elasticity would
pass for an encoder offset.
"""

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import Candidate
from pipelines.diagnosis.evidence.observed_run import Run


def bent_column(
    columns: NDArray, measured: NDArray, values: NDArray, untouched: NDArray, run: Run
) -> NDArray:
    """Return what the bent baseline's ``columns`` and ``measured`` torque add to the untouched
    ones, (m, O, 1) N·m."""
    plain = untouched @ values[: untouched.shape[2]]
    return (columns @ values - plain - (measured - run.measured))[:, :, np.newaxis]


def torque_columns(candidate: Candidate, number: int, run: Run) -> NDArray:
    """Return a torque effect's columns in one run, (m, O, k): in the drives, and in the cuffs where
    a person has it."""
    # As Model.regressor has it of one term that transforms nothing, which is called thousands of
    # times.
    columns = candidate.effect.columns(run.motion, candidate.shapes[number])
    cuffs = candidate.effect.cuff_columns(run.motion, columns)
    cuffs = np.zeros_like(columns) if cuffs is None else cuffs
    return run.average(np.concatenate([columns, cuffs], axis=1))
