"""Impacts: bursts of 4 to 25 Hz where the load changes sign, as teeth make that cross their play.

How the parts bounce no model foretells, so what play does is not found in the mean of the torque alone but in
where its scatter is large. The evidence is the log likelihood that two variances, one where the load has just
changed sign and one elsewhere, gain over a single one.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.floor import faster
from pipelines.diagnosis.observations import Run

SLOW_S = 0.2
"""Averages over this hold what is no burst."""
BEFORE_S, AFTER_S = 0.05, 0.35
"""About a change of sign: the load is an estimate, and what it strikes rings for a few swings."""
LOUDER = 1.25
"""Ratio of variances from which there is a burst at all: friction that changes with the load makes some scatter too."""
FEWEST = 30
"""Blocks of each kind that a variance is told from."""


def evidence_of_play(runs: Sequence[Run], residuals: Sequence[NDArray], independent_share: float) -> NDArray:
    """Return the log likelihood that play gains by its bursts at each joint, (J,).

    Parameters
    ----------
    runs : with loads estimated
    residuals : (m, O) of each run under the baseline
    independent_share : of samples
    """
    joints = len(runs[0].motion.joints)
    gains = np.zeros(joints)
    for j in range(joints):
        parts = [_squares(run, residual, j) for run, residual in zip(runs, residuals, strict=True)]
        near, far = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
        if min(len(near), len(far)) < FEWEST or not near.mean() > LOUDER * far.mean() > 0:
            continue
        both = np.concatenate([near, far])
        gain = sum(sign * len(x) * np.log(x.mean()) for sign, x in ((1, both), (-1, near), (-1, far)))
        gains[j] = 0.5 * independent_share * gain
    return gains


def _squares(run: Run, residual: NDArray, j: int) -> tuple[NDArray, NDArray]:
    """Return the squares of what is fast in a residual (m, O) at one joint, near changes of the load's sign and off."""
    assert run.motion.load is not None, "bursts are sought where the load is known"
    spacing = run.block.decimation / run.motion.sample_rate_hz
    fast = faster(run, residual, SLOW_S)[:, j]
    usable = ~np.isnan(fast)
    positive = run.average(run.motion.load)[:, j] > 0
    near = np.zeros(len(residual), dtype=bool)
    for at in np.flatnonzero(np.diff(positive)):
        near[max(0, at - round(BEFORE_S / spacing)) : at + round(AFTER_S / spacing)] = True
    return fast[near & usable] ** 2, fast[~near & usable] ** 2
