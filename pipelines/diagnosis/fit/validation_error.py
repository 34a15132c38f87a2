"""Measure errors and gains on validation runs, with intervals from whole periods.

A cause's gain is the increase of the error if that cause alone is left out and all else is fitted
again. The gain of a set of causes is relative to rigid body and friction.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.observed_run import Run


@dataclass(frozen=True)
class Errors:
    """Squared errors of one model on the validation runs, in blocks of whole periods."""

    squares: NDArray
    """(b, J) sums over scored samples."""
    counts: NDArray
    """(b,)."""
    unmasked: NDArray
    """(J,) rms on every valid sample, N·m."""
    measured: NDArray
    """(J,) bool: joints whose torque is known; the error of the others is zero here."""

    @property
    def rms(self) -> NDArray:
        """(J,) N·m over all scored samples."""
        return np.sqrt(self.squares.sum(axis=0) / max(self.counts.sum(), 1))

    def joint_of_largest_fall(self, after: "Errors") -> int:
        """Return the joint at which another model's error is smaller by most."""
        return int(np.argmax(np.where(self.measured, self.rms - after.rms, -np.inf)))


def scored(run: Run) -> NDArray:
    """Return the blocks that the RMSE counts.

    Parameters
    ----------
    run : Run
        m blocks.

    Returns
    -------
    (m,) bool array
        Whether every measured drive's output is usable.
    """
    measured = run.motion.machine.measured
    return np.asarray(run.usable[:, : len(measured)][:, measured].all(axis=1))


def errors_of(runs: Sequence[Run], residuals: Sequence[NDArray]) -> Errors:
    """Sum up the squared residuals of each run's drives, by period.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, N·m.

    Returns
    -------
    Errors
    """
    squares, counts, everywhere, valid = [], [], 0.0, 0
    # Length of a bootstrap block where the excitation does not repeat.
    stretch_s = 5.0
    for run, residual in zip(runs, residuals, strict=True):
        measured = run.motion.machine.measured
        J = len(measured)
        residual = np.where(measured, residual[:, :J], 0.0)
        chosen = scored(run)
        # Errors within a period are dependent, so whole periods are drawn in the bootstrap.
        length = run.motion.period_s or stretch_s
        number = np.floor(run.time / length).astype(int)
        number -= number.min()
        own = np.zeros((number.max() + 1, J))
        np.add.at(own, number[chosen], residual[chosen] ** 2)
        squares.append(own)
        counts.append(np.bincount(number[chosen], minlength=number.max() + 1))
        everywhere = everywhere + np.sum(residual[run.valid] ** 2, axis=0)
        valid += int(run.valid.sum())
    return Errors(
        np.concatenate(squares),
        np.concatenate(counts),
        np.sqrt(everywhere / max(valid, 1)),
        runs[0].motion.machine.measured,
    )


@dataclass(frozen=True)
class Gain:
    """RMSE before less after at one joint, N·m."""

    joint: int
    value: float
    low: float
    high: float


def gain(before: Errors, after: Errors, joint: int | None = None, seed: int = 0) -> Gain:
    """Return the gain at a joint, with a 95 % interval by resampling blocks.

    Parameters
    ----------
    before, after : Errors
        Errors of the same blocks without and with a cause, N·m.
    joint : int, optional
        The joint; that which gains most by default.
    seed : int, optional
        Seed of the random draws.
    """
    if joint is None:
        joint = before.joint_of_largest_fall(after)
    rng = np.random.default_rng(seed)
    blocks = len(before.counts)
    # Bootstrap samples of an interval.
    resamples = 500
    # The same blocks for both models, so that noise that they share cancels.
    drawn = rng.integers(0, blocks, (resamples, blocks))
    counts = np.maximum(before.counts[drawn].sum(axis=1), 1)
    worth = [np.sqrt(e.squares[drawn, joint].sum(axis=1) / counts) for e in (before, after)]
    low, high = np.quantile(worth[0] - worth[1], [0.025, 0.975])
    return Gain(joint, float(before.rms[joint] - after.rms[joint]), float(low), float(high))
