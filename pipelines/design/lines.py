"""The lines of a multisine: harmonics that are excited, and detection lines that are empty.

At even lines only an even nonlinearity makes a torque, and at empty odd lines only an odd one.
Source: R. Pintelon and J. Schoukens (2012), System Identification: A Frequency Domain Approach,
2nd edition, Wiley, sections 4.3 and 5.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.trajectory import Trajectory
from pipelines.settings.acquire import RunSettings

LARGEST_GROUP = 4
"""Odd harmonics of which one is left empty; a group has one less where they do not divide."""


def excited_lines(harmonics: int, seed: int) -> NDArray:
    """Draw the harmonics that a multisine excites.

    Of each group of three or four consecutive odd harmonics, a random one is left empty. On a
    regular grid, distortion of one order could miss every empty line.

    Parameters
    ----------
    harmonics : int
        The highest harmonic, at least 5.
    seed : int
        Equal seeds give equal lines.

    Returns
    -------
    (k,) array of int
        Odd numbers, ascending.
    """
    odd = np.arange(1, harmonics + 1, 2)
    rng = np.random.default_rng(seed)
    groups = np.array_split(odd, -(-len(odd) // LARGEST_GROUP))
    return np.concatenate([np.delete(group, rng.integers(len(group))) for group in groups])


def detection_lines(trajectory: Trajectory) -> list[int]:
    """Return the empty harmonics of a motion below its highest coefficient.

    Parameters
    ----------
    trajectory : Trajectory
        Of J joints; a Fourier series, or it has none.

    Returns
    -------
    list of int
        Even lines and empty odd ones; empty where the motion has no detection lines.
    """
    if not isinstance(trajectory, FourierTrajectory) or not trajectory.has_detection_lines:
        return []
    excited = set(trajectory.excited_lines)
    return [k for k in range(1, trajectory.a.shape[1] + 1) if k not in excited]


def cut_periods(runs: Iterable[RunSettings], trajectory: Trajectory) -> list[str]:
    """Return warnings of runs whose last period is cut short, or that have fewer than two.

    The noise at a detection line is the scatter over whole periods.

    Parameters
    ----------
    runs : iterable of RunSettings
        That follow the trajectory.
    trajectory : Trajectory
        With detection lines, or there is no warning.
    """
    period_s = trajectory.period_s
    if not period_s or not detection_lines(trajectory):
        return []
    warnings = []
    for run in runs:
        periods = run.duration_s / period_s
        whole = max(round(periods), 2)
        # Rounding of a period of 1/3 s, say, is no cut.
        if abs(periods - whole) > 1e-3:
            warnings.append(
                f"run {run.name} lasts {run.duration_s:g} s, {periods:.3g} periods; detection"
                f" lines need two or more whole ones, set duration_s = {whole * period_s:g}"
            )
    return warnings
