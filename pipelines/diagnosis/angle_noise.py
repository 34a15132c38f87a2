"""Noise of the angles: accelerations that no torque goes with let every fit take the machine for too light.

Where the motion nearly cancels what its torques would be, as in a free swing, little noise is enough. What the angles
hold above a low cut-off is either motion, which takes torque, or noise, which takes none: so the torque that the slow
motion's fit foretells from that part alone is held against the torque that was measured.
"""

from collections.abc import Sequence

import numpy as np

from pipelines.diagnosis.observations import Run, baseline_of
from pipelines.diagnosis.second_look import CUTOFF_HZ, below

REAL = 0.5
"""Share of the foretold torque that must be measured: 1 where the fast part is motion, 0 where it is noise."""
LOUD = 1.0
"""Times by which noise must outdo, rms, all that the slow motion's fit leaves: being less than half of the error's
power, it biases little."""


def is_loud(runs: Sequence[Run]) -> bool:
    """Tell whether noise of the angles outdoes, at any joint of the runs to train, all else that a fit leaves."""
    if any(run.motion.cutoff_hz is not None and run.motion.cutoff_hz <= CUTOFF_HZ for run in runs):
        return False
    baseline = baseline_of(runs)
    J, bodies = len(baseline.joints), baseline.body * len(baseline.bodies)
    fast, slow, torque, usable = [], [], [], []
    for run in runs:
        motion, calm = run.motion, below(run.motion, CUTOFF_HZ)
        fast.append(run.average(baseline.columns(motion, motion))[:, :J])
        slow.append(run.average(baseline.columns(calm, calm))[:, :J])
        torque.append(run.measured[:, :J])
        usable.append(run.usable[:, :J] & run.block.all(calm.valid, run.starts)[:, np.newaxis])
    extra, columns, tau, used = (np.concatenate(x) for x in (fast, slow, torque, usable))
    extra = extra - columns
    scale = np.sqrt(np.mean(np.where(used, tau, 0.0) ** 2, axis=0, keepdims=True)) + np.finfo(float).tiny
    weighted = np.where(used, 1.0 / scale, 0.0)
    values = np.linalg.lstsq((columns * weighted[..., np.newaxis]).reshape(-1, columns.shape[2]),
                             (tau * weighted).ravel(), rcond=None)[0]  # fmt: skip
    foretold = np.where(used, extra[..., :bodies] @ values[:bodies], 0.0)
    left = np.where(used, tau - columns @ values, 0.0)
    power = np.sum(foretold**2, axis=0)
    no_motion = np.sum(foretold * left, axis=0) < REAL * power
    return bool(np.any(no_motion & (power > LOUD**2 * np.sum(left**2, axis=0))))
