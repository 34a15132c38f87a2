"""A wearer who pushes, felt in the cuffs and by the drives at once: evidence that no rhythm has to
be guessed for.

What repeats with the motion may be a muscle's reflex or a spring; what does not, and comes through
the cuffs, is somebody's will. A machine's own troubles, a drag that wanders or a sensor that
drifts, leave the cuffs alone. The evidence is the log likelihood that the drives' scatter between
adjacent periods gains where the cuffs' is taken off it, newton metre for newton metre.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.noise_floor import scatter
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.evidence.slow_error import slowed

SLOW_S = 0.4
"""Length of the averages: what swings on a soft transmission is gone from them."""
NEEDED = 0.5
"""Share of an average that must be there: cuffs say nothing about turns, and a leg turns often."""
LOUDER = 1.25
"""Ratio of variances from which cuffs and drives feel the same at all."""
FEWEST = 30
"""Fewest averages from which a variance is estimated."""


def cuff_coherence(runs: Sequence[Run], residuals: Sequence[NDArray]) -> NDArray:
    """Return the log likelihood that a wearer's push gains by what does not repeat at each joint,
    (J,).

    Parameters
    ----------
    runs : with cuff torques as further outputs where there are any
    residuals : (m, 2 J) of each run under the baseline
    """
    joints = len(runs[0].motion.joints)
    slow = [
        slowed(run, residual, SLOW_S, NEEDED)
        for run, residual in zip(runs, residuals, strict=True)
        if run.has_cuffs
    ]
    gains = np.zeros(joints)
    if not slow:
        return gains
    scattered = np.concatenate([scatter(run, residual) for run, residual in slow])
    for j in range(joints):
        drive, cuff = scattered[:, j], scattered[:, joints + j]
        known = np.isfinite(drive) & np.isfinite(cuff)
        if known.sum() < FEWEST:
            continue
        before, after = np.mean(drive[known] ** 2), np.mean((drive - cuff)[known] ** 2)
        if before > LOUDER * after:
            # Neighbouring differences share a period: half of them are independent.
            gains[j] = 0.25 * known.sum() * np.log(before / after)
    return gains
