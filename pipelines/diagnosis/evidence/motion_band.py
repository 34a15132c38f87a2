"""The band in which a run's motion has its lines, and so has all that a model gets wrong of it."""

import numpy as np

from pipelines.diagnosis.evidence.observed_run import Run

LOWEST_HZ = 1.2
"""Below it the motion itself has its lines, however slow it is."""
HARMONICS, MOVING = 2.0, 0.99
"""Harmonics of the motion's own band that its misfit has lines up to, and share of the speed's
power in that band."""


def above_the_motion_hz(run: Run) -> float:
    """Return the frequency above which the motion, and what a model gets wrong of it, has no
    lines."""
    return max(LOWEST_HZ, HARMONICS * _band_hz(run))


def _band_hz(run: Run) -> float:
    """Return the frequency below which the joints' speeds have nearly all of their power."""
    speed = run.slow(run.motion.dq)[run.motion.valid]
    power = np.sum(np.abs(np.fft.rfft(speed - speed.mean(axis=0), axis=0)) ** 2, axis=1)
    share = np.cumsum(power) / max(power.sum(), np.finfo(float).tiny)
    return float(np.searchsorted(share, MOVING) * run.motion.sample_rate_hz / len(speed))
