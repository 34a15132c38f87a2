"""Estimate the band of a run's motion, and so of all errors of a model of it."""

import numpy as np

from pipelines.diagnosis.evidence.observed_run import Run

LOWEST_HZ = 1.2
"""Least frequency above the motion: below it a slow motion has lines too, Hz."""
HARMONICS, MOVING = 2.0, 0.99
"""Multiple of the motion's band in which its misfit has lines, and share of the speed's power in
that band."""


def above_the_motion_hz(run: Run) -> float:
    """Return the frequency, Hz, above which motion and model error have no lines."""
    return max(LOWEST_HZ, HARMONICS * _band_hz(run))


def _band_hz(run: Run) -> float:
    """Return the frequency, Hz, below which the joints' speeds have nearly all their power."""
    # The speed, not the angle, because it weights fast parts of the motion more.
    speed = run.slow(run.motion.dq)[run.motion.valid]
    power = np.sum(np.abs(np.fft.rfft(speed - speed.mean(axis=0), axis=0)) ** 2, axis=1)
    share = np.cumsum(power) / max(power.sum(), np.finfo(float).tiny)
    return float(np.searchsorted(share, MOVING) * run.motion.sample_rate_hz / len(speed))
