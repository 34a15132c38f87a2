"""Estimate the band of a run's motion, and so of all errors of a model of it."""

import numpy as np

from pipelines.diagnosis.evidence.observed_run import Run


def above_the_motion_hz(run: Run) -> float:
    """Return the frequency, Hz, above which motion and model error have no lines."""
    # Least frequency above the motion: below it a slow motion has lines too, Hz.
    lowest_hz = 1.2
    # Multiple of the motion's band in which its misfit has lines.
    multiple = 2.0
    return max(lowest_hz, multiple * _band_hz(run))


def _band_hz(run: Run) -> float:
    """Return the frequency, Hz, below which the joints' speeds have nearly all their power."""
    # The speed, not the angle, because it weights fast parts of the motion more.
    speed = run.slow(run.motion.dq)[run.motion.valid]
    power = np.sum(np.abs(np.fft.rfft(speed - speed.mean(axis=0), axis=0)) ** 2, axis=1)
    share = np.cumsum(power) / max(power.sum(), np.finfo(float).tiny)
    # Share of the speed's power in the motion's band.
    moving = 0.99
    return float(np.searchsorted(share, moving) * run.motion.sample_rate_hz / len(speed))
