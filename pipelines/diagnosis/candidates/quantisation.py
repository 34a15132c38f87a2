"""Find the step of a torque that is reported in coarse steps, and the rounding error.

Rounding to multiples of a step h adds h round(x / h) - x to a torque x: a sawtooth over x, whose
first harmonic is -(h / pi) sin(2 pi x / h) (Widrow and Kollar, 2008, Quantization Noise, chapter
4). So a step is a line of known phase in the spectrum of the residual over the torque. The line
remains where noise was added after the rounding, so that no value in the file lies on a grid.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import czt


@dataclass(frozen=True)
class SearchedSteps:
    """The steps that are sought. Torques and steps are in units of the joint's rms torque."""

    finest: float = 0.1
    """Finest step that is sought; a finer one adds less than three percent of the torque."""
    coarsest: float = 2.0
    """Coarsest step that is sought."""
    reach: float = 3.0
    """Torque on either side of its median in which a step is sought."""

    @property
    def independent(self) -> float:
        """Number of steps within the reach that differ by at least the width of a line."""
        return 2.0 * self.reach * (1.0 / self.finest - 1.0 / self.coarsest)


def rounding(torque: NDArray, step: float) -> NDArray:
    """Return the error of rounding a torque.

    Parameters
    ----------
    torque : (n,) array
        N·m.
    step : float
        Multiples to round to, N·m.

    Returns
    -------
    (n,) array
        Rounded less exact, N·m.
    """
    return step * np.round(torque / step) - torque


def coarse_step(torque: Sequence[NDArray], residual: Sequence[NDArray], rms: float) -> float | None:
    """Return the step, N·m, whose rounding error correlates most with the residual.

    Parameters
    ----------
    torque, residual : sequences of (n,) arrays
        Predicted torque of one joint, and measured less predicted, of each run, N·m.
    rms : float
        The joint's torque, N·m.

    Returns
    -------
    float or None
        None where no step correlates with the residual.
    """
    x, y = np.concatenate(torque), np.concatenate(residual)
    if not len(x) or not rms > 0.0:
        return None
    searched, middle = SearchedSteps(), float(np.median(x))
    # Farthest median, in reaches: no reading of a real torque varies by so small a share of it.
    farthest = 1000.0
    if abs(middle) > farthest * searched.reach * rms:
        return None
    # Bins of torque within the reach: 17 in the finest step. Each step then costs the same, however
    # long the recordings are.
    bins = 1024
    edges = middle + rms * np.linspace(-searched.reach, searched.reach, bins + 1)
    counts, totals = np.histogram(x, edges)[0], np.histogram(x, edges, weights=y)[0]
    # Steps tried within the width of a line.
    per_line = 4
    # Far from zero the phase of a line turns faster with its step.
    count = round(per_line * searched.independent * (1.0 + abs(middle) / (searched.reach * rms)))
    # Even spacing in 1 / h, because all lines have the same width there.
    per_step = np.linspace(1.0 / searched.coarsest, 1.0 / searched.finest, count) / rms
    centres = 0.5 * (edges[1:] + edges[:-1])
    # Sums of totals x -sin(2 pi x / h), and of counts x its square.
    along = _spectrum(totals, centres, per_step).imag
    size = 0.5 * (counts.sum() - _spectrum(counts, centres, 2.0 * per_step).real)
    # The phase is known: a line of opposite sign is no rounding error, and does not count.
    explained = np.where(along > 0.0, along**2 / np.maximum(size, 1.0), 0.0)
    best = int(np.argmax(explained))
    return float(1.0 / per_step[best]) if explained[best] > 0.0 else None


def _spectrum(weights: NDArray, x: NDArray, cycles: NDArray) -> NDArray:
    """Return the sums over b of weights exp(-2 pi i cycles x), (c,), of evenly spaced x and cycles.

    A matrix of all these waves would take gigabytes where the median is far from zero.
    """
    spacing, step = x[1] - x[0], cycles[1] - cycles[0]
    ratio, first = np.exp(-2j * np.pi * step * spacing), np.exp(2j * np.pi * cycles[0] * spacing)
    return np.exp(-2j * np.pi * cycles * x[0]) * czt(weights, len(cycles), ratio, first)
