"""Represent all runs as one linear regression: outputs, baseline columns, masks and folds.

An *output* is one measured torque: each drive's and, with cuff forces, the torque about each joint
that they exert on the person. The second pair is a second measurement of the human's share. It
separates causes in the drive or the structure from causes in the person.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.estimation.regression import (
    away_from_reversals,
    away_from_turns,
    block_average,
    with_rest,
)
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.slow_motion import filtered, unsure
from pipelines.signals.blocks import BlockAverage

FOLDS = 4
"""Number of folds of a run."""


@dataclass(frozen=True)
class Run:
    """One motion behind the regression filter, m blocks, O outputs (drives, then cuffs)."""

    motion: Motion
    block: BlockAverage
    starts: NDArray
    time: NDArray
    """(m,) s."""
    state: tuple[NDArray, NDArray, NDArray]
    """q, dq, ddq (m, J)."""
    measured: NDArray
    """(m, O) N·m; zero where there is no such output."""
    usable: NDArray
    """(m, O) bool; false at a joint whose torque was not measured."""
    valid: NDArray
    """(m,) bool."""
    fold: NDArray
    """(m,) number of the fold: whole periods, assigned in turn."""
    cutoff_hz: float | None = None
    """Frequency above which neither torque nor columns are used; None where all that blocks pass
    is."""
    fast: NDArray | None = None
    """(m, O) N·m of the torque that blocks pass and the cut-off does not."""

    def average(self, full_rate: NDArray) -> NDArray:
        """Filter and average to blocks.

        Parameters
        ----------
        full_rate : (n, ...) array
            At the sample rate.

        Returns
        -------
        (m, ...) array
            In the same unit.
        """
        return self.block.mean(self.slow(full_rate), self.starts)

    def slow(self, full_rate: NDArray) -> NDArray:
        """Return the content below the cut-off, if there is one.

        Parameters
        ----------
        full_rate : (n, ...) array
            At the sample rate.

        Returns
        -------
        (n, ...) array
            In the same unit.
        """
        return (
            full_rate
            if self.cutoff_hz is None
            else filtered(self.motion, full_rate, self.cutoff_hz)
        )

    def with_fast(self, residual: NDArray) -> NDArray:
        """Return a residual plus the torque above the cut-off, which may hum.

        Parameters
        ----------
        residual : (m, O) array
            N·m.

        Returns
        -------
        (m, O) array
            N·m.
        """
        return residual if self.fast is None else residual + self.fast

    def blocks_in(self, seconds: float) -> float:
        """Return the number of blocks in some time.

        Parameters
        ----------
        seconds : float
            s.
        """
        return seconds * self.motion.sample_rate_hz / self.block.decimation

    @property
    def bandwidth_hz(self) -> float:
        """Frequency at which the regression filter has lost half the power."""
        passed = self.block.cutoff_hz(self.motion.sample_rate_hz)
        return passed if self.cutoff_hz is None else min(passed, self.cutoff_hz)

    def measured_at(self, link: Motion) -> NDArray:
        """Return the torque measured if the links are not where the encoders say.

        Parameters
        ----------
        link : Motion
            n samples of the links.

        Returns
        -------
        (m, O) array
            N·m; only the cuffs' torque depends on the links.
        """
        if link.q is self.motion.q or not self.has_cuffs:
            return self.measured
        # The sensors turn with the links: at another angle a force has another lever arm.
        cuffs = self.motion.cuff_torque(link.q)
        assert cuffs is not None, "a run that has cuffs has their forces"
        joints = len(self.motion.joints)
        # As in ``observe``: a filter would spread one NaN over its whole stretch.
        return np.hstack([self.measured[:, :joints], self.average(np.nan_to_num(cuffs))])

    @property
    def has_cuffs(self) -> bool:
        """Whether the person's share was measured."""
        return self.measured.shape[1] > len(self.motion.joints) and bool(self.usable[:, -1].any())


def observe(motion: Motion, cutoff_hz: float | None = None) -> Run:
    """Filter and average one motion to blocks.

    Parameters
    ----------
    motion : Motion
        n samples of J joints.
    cutoff_hz : float, optional
        Cut-off of a low-pass before the averages, Hz.

    Returns
    -------
    Run
        m blocks of 2 J outputs: drives, then cuffs.
    """
    motion = with_rest(motion)
    block = block_average(motion)
    starts = block.starts(motion.segment)
    time = block.mean(motion.time, starts)
    # Next to a gap a low-pass lacks the samples of one side.
    trusted = motion.valid if cutoff_hz is None else motion.valid & ~unsure(motion, cutoff_hz)
    valid = block.all(trusted, starts)
    away = block.all(away_from_reversals(motion), starts) & motion.machine.measured
    usable = valid[:, np.newaxis] & away
    outputs = [motion.torque]
    cuffs = motion.cuff_torque(motion.q) if motion.run == "with_human" else None
    if cuffs is None:
        outputs.append(np.full_like(motion.torque, np.nan))
        usable = np.hstack([usable, np.zeros_like(usable)])
    else:
        # Cuffs do not measure the joint's friction, so slow motion does no harm, only turns do.
        known = np.isfinite(block.mean(cuffs, starts))
        outputs.append(cuffs)
        steady = block.all(away_from_turns(motion), starts)
        usable = np.hstack([usable, (valid & steady)[:, np.newaxis] & known])
    # A filter would spread one NaN over its whole stretch.
    whole = np.nan_to_num(np.hstack(outputs))
    slow = whole if cutoff_hz is None else filtered(motion, whole, cutoff_hz)
    # Time after which an excitation without a period moves to the next fold, s.
    fold_s = 10.0
    length = motion.period_s or fold_s
    # Rounding must not move the first block of a period into the one before.
    number = np.floor(time / length + 1e-9).astype(int)
    # A short run has no whole period for each fold, so its stretches are assigned to folds instead.
    part = min(length, (time[-1] - time[0]) / FOLDS + 1e-6)
    return Run(
        motion=motion,
        block=block,
        starts=starts,
        time=time,
        state=(
            block.mean(motion.q, starts),
            block.mean(motion.dq, starts),
            block.mean(motion.ddq, starts),
        ),
        measured=block.mean(slow, starts),
        usable=usable,
        valid=valid,
        fold=np.floor((time - time[0]) / part).astype(int) % FOLDS
        if part < length
        else number % FOLDS,
        cutoff_hz=cutoff_hz,
        fast=None if cutoff_hz is None else block.mean(whole - slow, starts),
    )
