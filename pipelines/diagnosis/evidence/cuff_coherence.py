"""Detect a wearer who pushes: torque that cuffs and drives share, and that does not repeat.

No rhythm has to be guessed. Torque that repeats with the motion may come from a reflex or a spring.
Torque that does not repeat, and passes through the cuffs, is voluntary. A machine's own faults, a
drag that wanders or a sensor that drifts, do not reach the cuffs. The evidence is the log
likelihood that the drives' scatter between adjacent periods gains if the cuffs' scatter is
subtracted from it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.noise_floor import scatter
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.evidence.slow_error import slowed


def cuff_coherence(runs: Sequence[Run], residuals: Sequence[NDArray]) -> NDArray:
    """Return the log likelihood of a wearer's push, from scatter at each joint, (J,).

    Parameters
    ----------
    runs : sequence of Run
        With cuff torques as further outputs where there are any.
    residuals : sequence of (m, 2 J) arrays
        Measured less predicted torque of each run under the baseline, N·m.
    """
    joints = len(runs[0].motion.joints)
    # Length of the averages, s: they suppress oscillations on a soft transmission.
    length_s = 0.4
    # Share of an average that must be present: cuffs have no samples near reversals, and a leg
    # reverses often.
    needed = 0.5
    slow = [
        slowed(run, residual, length_s, needed)
        for run, residual in zip(runs, residuals, strict=True)
        if run.has_cuffs
    ]
    gains = np.zeros(joints)
    if not slow:
        return gains
    scattered = np.concatenate([scatter(run, residual) for run, residual in slow])
    # Ratio of variances from which cuffs and drives share any torque.
    louder = 1.25
    # Fewest averages from which a variance is estimated.
    fewest = 30
    for j in range(joints):
        drive, cuff = scattered[:, j], scattered[:, joints + j]
        known = np.isfinite(drive) & np.isfinite(cuff)
        if known.sum() < fewest:
            continue
        # A push on the limb reaches the drive undiminished, so the plain difference removes it.
        before, after = np.mean(drive[known] ** 2), np.mean((drive - cuff)[known] ** 2)
        if before > louder * after:
            # Neighbouring differences share a period: half of them are independent.
            gains[j] = 0.25 * known.sum() * np.log(before / after)
    return gains
