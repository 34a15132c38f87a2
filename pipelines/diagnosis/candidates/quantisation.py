"""A torque that is told in coarse steps: the step that a residual shows, and what rounding to it adds.

Rounding to multiples of a step h adds h round(x / h) - x to a torque x: a sawtooth over x. Its first harmonic,
-(h / pi) sin(2 pi x / h), is a line of known phase in the spectrum of the residual over the torque. So the step is
found also where noise came after the rounding, and no value in the file lies on a grid.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FINEST, COARSEST = 0.1, 2.0
"""Steps that are sought, in units of the joint's rms torque. A finer one adds less than three percent of it."""
REACH = 3.0
"""Torque on either side of zero in which the step is sought, in the same unit."""
BINS = 1024
"""Of torque within that reach: over thirty in the finest step."""
PEAKS = 4
"""Steps tried within the width of a line."""
TRIED = 2.0 * REACH * (1.0 / FINEST - 1.0 / COARSEST)
"""Steps that can be told from one another within the reach."""


def rounding(torque: NDArray, step: float) -> NDArray:
    """Return what rounding to multiples of a step adds to a torque (n,), N·m."""
    return step * np.round(torque / step) - torque


def coarse_step(torque: Sequence[NDArray], residual: Sequence[NDArray], rms: float) -> float | None:
    """Return the step, N·m, by whose rounding a residual goes with the torque most; None where by none.

    Parameters
    ----------
    torque, residual : sequences of (n,) arrays
        Predicted torque of one joint, and measured less predicted, of each run, N·m.
    rms : float
        The joint's torque, N·m.
    """
    x, left = np.concatenate(torque), np.concatenate(residual)
    edges = np.linspace(-REACH * rms, REACH * rms, BINS + 1)
    counts, totals = np.histogram(x, edges)[0], np.histogram(x, edges, weights=left)[0]
    per_step = np.linspace(1.0 / COARSEST, 1.0 / FINEST, round(PEAKS * TRIED)) / rms
    waves = -np.sin(2.0 * np.pi * np.outer(per_step, 0.5 * (edges[1:] + edges[:-1])))
    along, size = waves @ totals, waves**2 @ counts
    explained = np.where(along > 0.0, along**2 / np.maximum(size, 1.0), 0.0)
    best = int(np.argmax(explained))
    return float(1.0 / per_step[best]) if explained[best] > 0.0 else None
