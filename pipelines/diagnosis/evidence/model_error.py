"""Estimate the error of a good rig's model: a share of the variation of its torques.

An error in proportion to the torque varies with it. A constant that the baseline has anyway, as a
lift's weight, is subtracted and hides nothing. At a passive joint the drive's torque is zero, and
inertia, weight and friction balance: their size takes its place.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.baseline_columns import columns_under
from pipelines.diagnosis.evidence.observed_run import Run


def imperfection(runs: Sequence[Run], baseline: Baseline, values: NDArray) -> NDArray:
    """Return the error that every model of a real machine has.

    Parameters
    ----------
    runs : sequence of Run
        The searched runs.
    baseline : Baseline
        Of b columns.
    values : (b,) array
        The baseline fitted alone.

    Returns
    -------
    (O,) array
        N·m.
    """
    torque = varying_torque(runs, baseline, values)
    # Shares of a drive's and of a cuff's torque that even a good model of a good machine does not
    # explain. Drives come first.
    shares = (0.009, 0.02)
    return torque * np.repeat(shares, len(torque) // 2)


def varying_torque(runs: Sequence[Run], baseline: Baseline, values: NDArray) -> NDArray:
    """Return the rms of each output's torque.

    A constant is subtracted where the machine's bodies have one.

    Parameters
    ----------
    runs : sequence of Run
        The searched runs.
    baseline : Baseline
        Of b columns.
    values : (b,) array
        The baseline fitted alone.

    Returns
    -------
    (O,) array
        N·m.
    """
    passive = [j for j, one in enumerate(baseline.machine.joints) if one.is_passive]
    squares, count = np.zeros(runs[0].measured.shape[1]), np.zeros(runs[0].measured.shape[1])
    for run in runs:
        known = np.where(run.usable, run.measured, 0.0)
        number = run.usable.sum(axis=0)
        squares += np.sum(known**2, axis=0)
        if "constant" in run.motion.machine.mechanism.absorbs:
            squares -= np.sum(known, axis=0) ** 2 / np.maximum(number, 1)
        for j in passive:
            parts = columns_under((), run, baseline)[0][run.usable[:, j], j] * values
            # Half, because parts that balance in pairs have the size of either.
            squares[j] += 0.5 * np.sum(parts**2)
        count += number
    torque = np.sqrt(np.maximum(squares, 0.0) / np.maximum(count, 1))
    # Columns are shares of the torque, also at a joint whose torque was not measured.
    measured = baseline.machine.measured
    drives = torque[: len(measured)]
    drives[~measured] = drives[measured].min()
    return torque
