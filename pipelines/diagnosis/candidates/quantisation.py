"""A torque that is reported in coarse steps: the step that a residual shows, and what rounding to
it adds.

Rounding to multiples of a step h adds h round(x / h) - x to a torque x: a sawtooth over x, whose
first harmonic is -(h / pi) sin(2 pi x / h) (Widrow and Kollar, 2008, Quantization Noise, chapter
4). So a step is a line of known phase in the spectrum of the residual over the torque. It is found
also where noise came after the rounding, so that no value in the file lies on a grid.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FINEST, COARSEST = 0.1, 2.0
"""Steps that are sought, in units of the joint's rms torque. A finer one adds less than three
percent of it."""
REACH = 3.0
"""Torque on either side of its median in which the step is sought, in the same unit."""
BINS = 1024
"""Of torque within that reach: 17 in the finest step."""
PEAKS = 4
"""Steps tried within the width of a line."""
STEPS_TRIED = 2.0 * REACH * (1.0 / FINEST - 1.0 / COARSEST)
"""Number of steps within the reach that differ by at least the width of a line."""


def rounding(torque: NDArray, step: float) -> NDArray:
    """Return what rounding to multiples of a step adds to a torque (n,), N·m."""
    return step * np.round(torque / step) - torque


def coarse_step(torque: Sequence[NDArray], residual: Sequence[NDArray], rms: float) -> float | None:
    """Return the step whose rounding error correlates most with the residual, N·m; None where none
    does.

    Parameters
    ----------
    torque, residual : sequences of (n,) arrays
        Predicted torque of one joint, and measured less predicted, of each run, N·m.
    rms : float
        The joint's torque, N·m.
    """
    x, y = np.concatenate(torque), np.concatenate(residual)
    if not len(x) or not rms > 0.0:
        return None
    middle = float(np.median(x))
    edges = middle + rms * np.linspace(-REACH, REACH, BINS + 1)
    counts, totals = np.histogram(x, edges)[0], np.histogram(x, edges, weights=y)[0]
    # Far from zero the phase of a line turns faster with its step.
    count = round(PEAKS * STEPS_TRIED * (1.0 + abs(middle) / (REACH * rms)))
    per_step = np.linspace(1.0 / COARSEST, 1.0 / FINEST, count) / rms
    waves = -np.sin(2.0 * np.pi * np.outer(per_step, 0.5 * (edges[1:] + edges[:-1])))
    along, size = waves @ totals, waves**2 @ counts
    explained = np.where(along > 0.0, along**2 / np.maximum(size, 1.0), 0.0)
    best = int(np.argmax(explained))
    return float(1.0 / per_step[best]) if explained[best] > 0.0 else None
