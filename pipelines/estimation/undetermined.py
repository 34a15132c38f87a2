"""Find inertial parameters that no equation with a known torque contains."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.estimation.regression import with_rest
from pipelines.mechanics.run import Run, kinds_of
from pipelines.model.parameter_layout import ParameterLayout


def undetermined(layout: ParameterLayout, runs: Sequence[Run]) -> NDArray:
    """Return the columns that are zero wherever a torque is known.

    A thigh's own inertia loads the hip alone, so nothing determines it without the hip's torque.

    Parameters
    ----------
    layout : ParameterLayout
        Of p columns; only those of rigid bodies are examined.
    runs : sequence of Run
        The fitted runs of one machine.

    Returns
    -------
    (p,) bool array
        False everywhere if every torque is known.
    """
    result = np.zeros(layout.size, dtype=bool)
    if not runs or runs[0].machine.measured.all():
        return result
    kinds = kinds_of(runs)
    for k, places in enumerate(layout.bodies):
        # The machine's body is fitted to runs without a wearer, if there are any.
        kind = kinds[0] if k == 0 else "with_human"
        columns = [c for run in runs if run.run == kind for c in _columns(run)]
        result[places] = ~np.any(columns, axis=0)
    return result


def _columns(run: Run) -> Iterator[NDArray]:
    """Yield for each piece of a run whether a column is not zero at a measured joint, (k,)."""
    measured = run.machine.measured
    for piece in run.pieces(0):
        motion = with_rest(piece.motion)
        columns = run.machine.mechanism.regressor(motion.q, motion.dq, motion.ddq, motion.geometry)
        yield np.any(columns[motion.valid][:, measured] != 0.0, axis=(0, 1))
