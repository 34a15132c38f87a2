"""Find samples that were taken at other instants than their even stamps.

An instant that is off by d shifts every angle by its speed times d. The third differences of two
joints then correlate as their speeds do. No vibration, count or friction of one joint does that.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.fault_kind import FaultKind
from pipelines.diagnosis.data_faults.fault import Fault
from pipelines.diagnosis.data_faults.mends import mended
from pipelines.diagnosis.data_faults.proof import by_motion
from pipelines.mechanics.motion import Motion

UNEVEN = 0.05
"""Rms deviation of instants that counts as a fault, in sample periods. Sticking joints and impacts
reach 0.01."""
EVEN = 0.04
"""Largest deviation of an even stamp, in sample periods; a larger one is reported as another
fault."""
SURE = 5.0
"""Standard errors that a correlation must exceed."""
WINDOW = 4
"""Number of samples in a third difference."""
SPREAD = 20.0
"""Variance of the third difference of independent numbers: 1 + 9 + 9 + 1."""
BLOCK = 20
"""Differences in a sum. Neighbouring differences share samples; sums over so many are nearly
independent."""
LEAST = 1000
"""Fewest differences for a verdict."""


def sampling_faults(motion: Motion) -> Iterator[Fault]:
    """Yield a fault where two joints' angles show that they were sampled at uneven instants."""
    if motion.measured_angle is None or motion.q.shape[1] < 2 or len(motion) < WINDOW:
        return
    trusted = _undisturbed(motion)
    if trusted.sum() < LEAST:
        return
    # Third differences remove the smooth motion and keep the jumps.
    rough = np.diff(motion.measured_angle[:, :2], 3, axis=0)[trusted]
    speeds = np.prod(motion.dq[2:-1, :2][trusted], axis=1)
    # Instants with variance v make both differences correlate by SPREAD v times both speeds. So the
    # regression of the one product on the other gives v.
    alike = np.prod(rough, axis=1) * speeds
    sums = alike[: len(alike) // BLOCK * BLOCK].reshape(-1, BLOCK).sum(axis=1)
    variance = max(float(alike.sum()), 0.0) / (SPREAD * max(float(speeds @ speeds), 1e-12))
    jitter = np.sqrt(variance) * motion.sample_rate_hz
    if jitter > UNEVEN and sums.sum() > SURE * np.sqrt(len(sums)) * sums.std():
        yield Fault(
            FaultKind.CLOCK,
            motion.file,
            "time_s",
            "clock jitter: the stamps are even, but all angles jump together. The samples are"
            f" {100 * jitter:.2g} % of a sample period rms"
            f" ({1e3 * jitter / motion.sample_rate_hz:.2g} ms) off, all along; store the measured"
            " instants, not the planned ones",
            proof=by_motion(motion, mended(motion, angle=_taken_evenly(motion))),
        )


def _undisturbed(motion: Motion) -> NDArray:
    """Return which third differences lie on even stamps and valid samples, (n - 3,) bool."""
    even = np.abs(np.diff(motion.time) * motion.sample_rate_hz - 1.0) < EVEN
    good = motion.valid[1:] & motion.valid[:-1] & even
    return np.asarray(np.lib.stride_tricks.sliding_window_view(good, WINDOW - 1).all(axis=1))


def _taken_evenly(motion: Motion) -> NDArray:
    """Return the angles (n, J) without the steps that all joints make together.

    Each sample's delay is the one that brings the angles closest to the smooth motion.
    """
    assert motion.measured_angle is not None
    stray = motion.measured_angle - motion.q
    squares = np.sum(motion.dq**2, axis=1)
    delay = np.sum(stray * motion.dq, axis=1) / np.maximum(squares, np.mean(squares) / SURE)
    return np.asarray(motion.measured_angle - delay[:, np.newaxis] * motion.dq)
