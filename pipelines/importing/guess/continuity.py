"""Whether readings go on from row to row, as those of a motion in a known encoding do."""

import numpy as np
from numpy.typing import NDArray


def is_continuous(values: NDArray) -> bool:
    """Return whether readings (n,) move without jumps, and smoothly at some distance of rows.

    Readings in an encoding that is not known, such as Gray's code, jump to and fro.
    """
    known = values[np.isfinite(values)]
    if len(known) < 3 or np.ptp(known) == 0.0:
        return True
    steps = np.abs(np.diff(known))
    far = steps > 0.5 * np.ptp(known)
    # Where every step is far, rows are too rare to show a motion.
    if far.any() and not far.all() and np.max(steps[~far]) < 0.25 * np.ptp(known):
        return False
    # White noise has 1.7; rows some way apart, as neighbours may differ by an encoder's step.
    strides = [stride for stride in (1, 2, 5, 10, 20) if len(known) > 10 * stride]
    return not strides or min(_roughness(known[::stride]) for stride in strides) < 1.0


def crosses_zero(values: NDArray) -> bool:
    """Return whether readings (n,) pass zero by small steps where their sign changes."""
    known = values[np.isfinite(values)]
    changes = np.sign(known[1:]) * np.sign(known[:-1]) < 0
    return not changes.any() or bool(
        np.median(np.abs(np.diff(known))[changes]) < 0.5 * np.ptp(known)
    )


def _roughness(values: NDArray) -> float:
    """Return the mean change of a step relative to the mean step."""
    step = float(np.mean(np.abs(np.diff(values))))
    return float(np.mean(np.abs(np.diff(values, n=2)))) / step if step else np.inf
