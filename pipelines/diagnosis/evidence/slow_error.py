"""Compute residuals below a few hertz, the band of a machine's physics.

The torque is averaged over 25 ms, and the acceleration comes from a filter that passes 8 to 12 Hz.
Between the two the torque holds the drive's response to counted angles. It repeats with the motion,
but is no missing physics, and no model of the motion can predict it. So longer averages show
whether an error is systematic.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.noise_floor import noise_floor
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.signals.blocks import BlockAverage


@dataclass(frozen=True)
class SlowError:
    """Error of each output, (O,) each; outputs that were not measured have an infinite floor."""

    rms: NDArray
    """N·m."""
    floor: NDArray
    """N·m, from the part that does not repeat."""
    independent: NDArray
    """Independent samples."""

    @property
    def excess(self) -> NDArray:
        """Systematic error, (O,) N·m."""
        return np.sqrt(np.maximum(self.rms**2 - self.floor**2, 0.0))


def slow_error(runs: Sequence[Run], residuals: Sequence[NDArray]) -> SlowError:
    """Return the error of residuals in the slow band.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, N·m.

    Returns
    -------
    SlowError
    """
    slow = [slowed(run, residual) for run, residual in zip(runs, residuals, strict=True)]
    longer = [run for run, _ in slow]
    floor = noise_floor(longer, [residual for _, residual in slow])
    squares = [np.sum(np.where(run.usable, r, 0.0) ** 2, axis=0) for run, r in slow]
    count = np.maximum(np.sum([run.usable.sum(axis=0) for run in longer], axis=0), 1)
    rms = np.sqrt(np.sum(squares, axis=0) / count)
    independent = count * floor.independent_share
    # An unknown floor is infinite: with 20 differences or fewer nothing is systematic.
    known = np.where(np.isfinite(floor.rms), floor.rms, np.inf)
    return SlowError(rms, known, independent)


def slowed(
    run: Run, residual: NDArray, length_s: float = 0.1, needed: float = 1.0
) -> tuple[Run, NDArray]:
    """Average neighbouring blocks to a length, never across a gap.

    Parameters
    ----------
    run : Run
    residual : (m, O) array
        N·m.
    length_s : float, optional
        Length of an average, s; the default passes frequencies below 4.4 Hz.
    needed : float, optional
        Share of its blocks that must be usable.

    Returns
    -------
    Run
        With the longer blocks.
    (m/k, O) array
        Averages, N·m.
    """
    width = run.block.decimation / run.motion.sample_rate_hz
    k = max(1, round(length_s / width))
    whole = len(residual) // k * k
    time = run.time[:whole].reshape(-1, k)
    # A group across a gap lasts longer than its blocks together, and is not used.
    together = time[:, -1] - time[:, 0] < (k - 0.5) * width
    there = run.usable[:whole].reshape(-1, k, residual.shape[1])
    count = there.sum(axis=1)
    mean = np.where(there, residual[:whole].reshape(there.shape), 0.0).sum(axis=1) / np.maximum(
        count, 1
    )
    usable = (count >= needed * k) & together[:, np.newaxis]
    longer = replace(
        run, time=time.mean(axis=1), usable=usable, block=BlockAverage(k * run.block.decimation)
    )
    return longer, mean
