"""Tones in a residual: a hum that knows nothing of the motion, and that no average over periods shows."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.observed_run import Run

LOWEST_HZ = 1.2
"""Below it the motion itself has its lines, however slow it is."""
HARMONICS, MOVING = 2.0, 0.99
"""Harmonics of the motion's own band that its misfit has lines up to, and share of the speed's power in that band."""
SHORTEST = 256
"""Blocks in which a line stands out."""
WIDTH = 2
"""Bins on each side of a line that a Hann window spreads it over."""


def strongest_tone(runs: Sequence[Run], residuals: Sequence[NDArray]) -> NDArray:
    """Return the rms (N·m) of the strongest line in any run's residual (m, O), for each output, (O,).

    A line is the power within ``WIDTH`` bins of the highest; of noise alone that is some 0.1 of its rms over a run.
    Only where the motion has none of its own.
    """
    tones = np.zeros(residuals[0].shape[1])
    for run, residual in zip(runs, residuals, strict=True):
        spacing = run.block.decimation / run.motion.sample_rate_hz
        slots = np.round((run.time - run.time[0]) / spacing).astype(int)
        if len(slots) < SHORTEST:
            continue
        filled = np.zeros((slots[-1] + 1, residual.shape[1]))
        filled[slots] = np.where(run.usable, residual, 0.0)
        there = np.maximum(run.usable.mean(axis=0) * len(slots) / len(filled), 1e-3)
        window = np.hanning(len(filled))
        power = np.abs(np.fft.rfft(filled * window[:, np.newaxis], axis=0)) ** 2
        power *= 2.0 / (np.sum(window**2) * len(filled)) / there**2
        power[np.fft.rfftfreq(len(filled), spacing) < above_the_motion_hz(run)] = 0.0
        peak = np.argmax(power, axis=0)
        for o, at in enumerate(peak):
            tones[o] = max(tones[o], np.sqrt(power[max(at - WIDTH, 0) : at + WIDTH + 1, o].sum()))
    return tones


def above_the_motion_hz(run: Run) -> float:
    """Return the frequency above which the motion, and what a model gets wrong of it, has no lines."""
    return max(LOWEST_HZ, HARMONICS * _band_hz(run))


def _band_hz(run: Run) -> float:
    """Return the frequency below which the joints' speeds have nearly all of their power."""
    speed = run.slow(run.motion.dq)[run.motion.valid]
    power = np.sum(np.abs(np.fft.rfft(speed - speed.mean(axis=0), axis=0)) ** 2, axis=1)
    share = np.cumsum(power) / max(power.sum(), np.finfo(float).tiny)
    return float(np.searchsorted(share, MOVING) * run.motion.sample_rate_hz / len(speed))
