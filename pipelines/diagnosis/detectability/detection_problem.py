"""The rows in which an effect must show, in units of the noise and without the baseline's share."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.criteria import CRITERIA
from pipelines.diagnosis.evidence.baseline import Baseline, with_load
from pipelines.diagnosis.evidence.baseline_columns import columns_under, gram_of_runs
from pipelines.diagnosis.evidence.gram import solve
from pipelines.diagnosis.evidence.noise_floor import Floor
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.effects import Effect


@dataclass(frozen=True)
class DetectionProblem:
    """Detection problem of some runs: rows in units of the noise, the baseline projected out."""

    runs: tuple[Run, ...]
    baseline: Baseline
    untouched: tuple[NDArray, ...]
    values: NDArray
    """The baseline's values under which the motion is transformed."""
    root: NDArray
    """(O,) root of the independent share over the noise; zero without such an output."""
    independent: float
    """Independent samples of the output that has most."""
    basis: NDArray
    """(rows, size) orthonormal basis of the weighted baseline."""
    torque_rms: NDArray
    """(O,) N·m, of the baseline's torque."""
    background: NDArray
    """(rows, k) what a good rig has of each cause, one standard deviation, the baseline projected
    out."""

    @classmethod
    def of(cls, runs: Sequence[Run], baseline: Baseline, floor: Floor) -> "DetectionProblem":
        """Fit the baseline and prepare its projection.

        Parameters
        ----------
        runs : sequence of Run
            Planned or recorded runs.
        baseline : Baseline
            Rigid body and friction.
        floor : Floor
            Noise of each output, N·m.
        """
        untouched = tuple(columns_under((), run, baseline)[0] for run in runs)
        plain = gram_of_runs(runs, untouched)
        there = np.isfinite(floor.rms) & (floor.rms > 0)
        noise, share = np.where(there, floor.rms, 1.0), floor.independent_share
        drives = len(noise) // 2
        # A weight above one corrects noise that is overestimated from recordings; here it is given.
        weights = np.minimum([CRITERIA.drive_weight, CRITERIA.cuff_weight], 1.0)
        counts = np.repeat(weights, drives)
        # Correlated blocks count as fewer: the likelihood is scaled by their independent share.
        root = np.where(there, np.sqrt(counts * share) / noise, 0.0)
        independent = float(np.max(share * plain.count))
        values = solve(plain, root**2)
        # Torques that depend on load take it from the fitted bodies, as in a diagnosis.
        loaded = tuple(with_load(run, baseline, values) for run in runs)
        torque = np.concatenate(
            [(c @ values)[run.valid] for run, c in zip(runs, untouched, strict=True)]
        )
        rms = np.sqrt(np.mean(torque**2, axis=0))
        nothing = np.zeros((sum(int(run.usable.sum()) for run in loaded), 0))
        return cls(
            loaded, baseline, untouched, values, root, independent, nothing, rms, nothing
        )._with_basis()

    def weighted(self, weights: NDArray) -> "DetectionProblem":
        """Return the problem with other weights of the outputs, (O,), as factors."""
        root = np.sqrt(weights)
        problem = replace(self, root=self.root * root)._with_basis()
        background = self.background * root[self.outputs, np.newaxis]
        return replace(problem, background=problem._without_baseline(background))

    def _with_basis(self) -> "DetectionProblem":
        """Return the problem with the basis of its weighted baseline."""
        rows = self.rows(self.untouched)
        # QR would invent a direction for a column of zeros.
        return replace(self, basis=np.linalg.qr(rows[:, rows.any(axis=0)])[0])

    @property
    def outputs(self) -> NDArray:
        """Number of the output of each row, (rows,)."""
        return np.concatenate([np.nonzero(run.usable)[1] for run in self.runs])

    def rows(self, columns: Sequence[NDArray]) -> NDArray:
        """Return columns as weighted rows, usable ones only.

        Parameters
        ----------
        columns : sequence of (m, O, k) arrays
            One of each run, N·m per unit.

        Returns
        -------
        (rows, k) array
            In units of the noise.
        """
        scaled = (c * self.root[:, np.newaxis] for c in columns)
        return np.concatenate([s[run.usable] for run, s in zip(self.runs, scaled, strict=True)])

    def remainder(self, columns: Sequence[NDArray]) -> NDArray:
        """Return columns less their projection on the baseline.

        Parameters
        ----------
        columns : sequence of (m, O, k) arrays
            One of each run, N·m per unit.

        Returns
        -------
        (rows, k) array
            In units of the noise.
        """
        return self._without_baseline(self.rows(columns))

    def _without_baseline(self, rows: NDArray) -> NDArray:
        for _ in range(2):  # twice is enough for orthogonality to rounding
            rows = rows - self.basis @ (self.basis.T @ rows)
        return rows

    def whitened(self, remainder: NDArray) -> NDArray:
        """Return a remainder, (rows,) or (rows, k), as it shows against noise and background.

        The background is marginalised, as in a diagnosis: with its columns B the noise has the
        covariance I + BB', which is one after the product with (I + BB')^(-1/2).
        """
        B = self.background
        return remainder - B @ (self._taken @ (B.T @ remainder))

    def shown(self, remainder: NDArray) -> float:
        """Return the squared length of a remainder (rows,) that the background does not explain."""
        return float(np.sum(self.whitened(remainder) ** 2))

    @cached_property
    def _taken(self) -> NDArray:
        """The matrix M, (k, k), with (I + BB')^(-1/2) = I - BMB'."""
        squares, axes = np.linalg.eigh(self.background.T @ self.background)
        squares = np.maximum(squares, 0.0)
        # (1 - 1 / root) / square, without a difference of nearly equal numbers.
        root = np.sqrt(1.0 + squares)
        return (axes / (root * (1.0 + root))) @ axes.T

    def joint(self, effect: Effect) -> int:
        """Return the joint at which an effect's size is given: its own, if it is measured.

        For a whole machine it is the first, and otherwise the first measured one.
        """
        motion = self.runs[0].motion
        j = max(effect.column(motion), 0)
        return j if motion.machine.measured[j] else int(np.argmax(motion.machine.measured))

    def rms(self, effect: Effect, column: Sequence[NDArray]) -> float:
        """Return the rms of a column at the effect's joint, where it acts.

        Parameters
        ----------
        effect : Effect
            Whose joint and runs count.
        column : sequence of (m, O, 1) arrays
            One of each run, N·m.

        Returns
        -------
        float
            N·m; 0 where the joint has no usable samples.
        """
        j = self.joint(effect)
        # Runs in which the effect does not act would lower its rms.
        acting = [
            (r, c) for r, c in zip(self.runs, column, strict=True) if effect.explains(r.motion)
        ]
        values = np.concatenate([c[r.usable[:, j], j, 0] for r, c in acting])
        return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
