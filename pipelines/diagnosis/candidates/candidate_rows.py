"""Compute a candidate's rows in the decision regression, once a block.

The decision band is slow enough for that (tests/diagnosis/test_block_rate.py). The exception is
waves over the angle that pass within a few blocks.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.candidate import TURNS, Candidate
from pipelines.diagnosis.candidates.columns import torque_columns
from pipelines.diagnosis.evidence.baseline import Baseline, relaxed, with_load
from pipelines.diagnosis.evidence.baseline_columns import columns_under
from pipelines.diagnosis.evidence.block_rate import at_block_rate
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.diagnosis.evidence.observed_run import Run


class CandidateRows:
    """Computes weighted rows (N, k) of candidates; nothing is projected out."""

    def __init__(
        self, runs: Sequence[Run], baseline: Baseline, regression: DecisionRegression
    ) -> None:
        """Prepare the runs at both rates."""
        self._baseline, self._regression = baseline, regression
        self._runs, self._slow = list(runs), [at_block_rate(run) for run in runs]
        self._plain = [columns_under((), run, baseline) for run in self._slow]
        self._plain_rows = regression.rows([columns for columns, _ in self._plain])
        names = runs[0].motion.joints
        # The 90 % quantile counts: a wave must be resolved in most blocks, not in the fastest few.
        steps = np.max(
            [np.quantile(np.abs(np.diff(run.state[0], axis=0)), 0.9, axis=0) for run in runs],
            axis=0,
        )
        self._steps = dict(zip(names, steps, strict=True))
        self._kinds = [run.motion.run for run in runs]
        self._last_loaded: tuple[tuple[float, ...], list[Run]] = (), self._slow
        self._last_change: tuple[Candidate, NDArray | None, tuple[NDArray, NDArray]] | None = None

    def __call__(self, candidate: Candidate, others: NDArray | None = None) -> NDArray | None:
        """Return a candidate's rows.

        Parameters
        ----------
        candidate : Candidate
        others : (N, b) array, optional
            Rows of other causes, fitted with the baseline where the candidate transforms the
            motion.

        Returns
        -------
        (N, k) array or None
            None where the rows are not finite.
        """
        if not candidate.transforms_motion:
            runs = self._runs if self._ripples_within_blocks(candidate) else self._slow
            own = candidate.columns_in(self._kinds)
            parts = (torque_columns(candidate, r, run) for r, run in enumerate(runs))
            rows = self._regression.rows([own.expand(part, r) for r, part in enumerate(parts)])
        elif candidate.directions:
            # The effect is linear along its directions, so each gives its column by itself.
            shapes = ((shape,) * len(self._kinds) for shape in candidate.directions)
            single = [Candidate(candidate.effect, own) for own in shapes]
            rows = np.hstack([self._transformed(one, others) for one in single])
        else:
            rows = self._transformed(candidate, others)
        return rows if np.isfinite(rows).all() else None

    def with_refitted_bodies(
        self, candidate: Candidate, others: NDArray | None = None
    ) -> Candidate:
        """Return a transmission with the rigid bodies of a joint fit of baseline and transmission.

        A fit of the baseline alone is biased by the missing transmission.

        Parameters
        ----------
        candidate : Candidate
        others : (N, b) array, optional
            Rows of other causes that are fitted with them.
        """
        _, refitted = self._change(candidate, others)
        bodies = relaxed(refitted, np.array(candidate.bodies) if candidate.bodies else None)
        return replace(candidate, bodies=tuple(bodies.tolist()))

    def _with_loads(self, candidate: Candidate) -> list[Run]:
        """Return the runs with the loads of a candidate's rigid bodies."""
        if not candidate.bodies:
            return self._slow
        if self._last_loaded[0] != candidate.bodies:  # most often they are those of the call before
            values = np.array(candidate.bodies)
            self._last_loaded = (
                candidate.bodies,
                [with_load(run, self._baseline, values) for run in self._slow],
            )
        return self._last_loaded[1]

    def _ripples_within_blocks(self, candidate: Candidate) -> bool:
        """Return whether a wave over the angle passes within a few blocks."""
        joint, shapes = candidate.effect.joint, candidate.effect.shape
        if joint is None or not any(parameter.unit in TURNS for parameter in shapes):
            return False
        cycles = max(
            value for p, value in zip(shapes, candidate.shapes[0], strict=True) if p.unit in TURNS
        )
        # Angle of a wave from block to block, rad, above which block averages do not follow it.
        longest_step_rad = 0.5
        return cycles * self._steps[joint] > longest_step_rad

    def _transformed(self, candidate: Candidate, others: NDArray | None) -> NDArray:
        """Return the change of the transformed baseline against the plain one, at its own values.

        Each run has a column of its own where its shape is its own.
        """
        row, _ = self._change(candidate, others)
        if not candidate.effect.per_run:
            return row
        numbers = [r for r, run in enumerate(self._slow) if candidate.effect.explains(run.motion)]
        return row * (self._regression.run[:, np.newaxis] == np.array(numbers))

    def _change(self, candidate: Candidate, others: NDArray | None) -> tuple[NDArray, NDArray]:
        """Return the change of the prediction by a transformed motion, (N, 1), and values, (b,).

        The values are those of the baseline under that motion.
        """
        last = self._last_change
        # A caller needs the rows first, then the bodies of the same candidate.
        if last is None or last[0] != candidate or last[1] is not others:
            last = self._last_change = candidate, others, self._compute_change(candidate, others)
        return last[2]

    def _compute_change(
        self, candidate: Candidate, others: NDArray | None
    ) -> tuple[NDArray, NDArray]:
        regression, runs = self._regression, self._with_loads(candidate)
        acting = [candidate.effect.explains(run.motion) for run in runs]
        transformed = [
            columns_under([candidate.term(r)], run, self._baseline) if acts else self._plain[r]
            for r, (run, acts) in enumerate(zip(runs, acting, strict=True))
        ]
        columns = regression.rows([c for c, _ in transformed])
        change = regression.rows(
            [
                (y - run.measured)[:, :, np.newaxis]
                for (_, y), run in zip(transformed, runs, strict=True)
            ]
        )
        # The baseline is fitted again: values from the plain motion are biased without the effect.
        # Other causes of the set are fitted too, or the baseline would imitate them.
        target = regression.torque_rows + change[:, 0]
        wide = columns if others is None else np.hstack([columns, others])
        values = _least_squares(wide, target)[: columns.shape[1]]
        # From y + change = C' v follows y = C v + ((C' - C) v - change). The bracket is the column
        # that the plain baseline C lacks.
        return ((columns - self._plain_rows) @ values)[:, np.newaxis] - change, values


def _least_squares(rows: NDArray, target: NDArray) -> NDArray:
    """Return the coefficients (k,) with which rows (N, k) come nearest to a target (N,)."""
    gram = rows.T @ rows
    size = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    # Relative to a column's square: keeps a refit of nearly dependent columns finite.
    ridge = 1e-10
    scaled = gram / np.outer(size, size) + ridge * np.eye(len(size))
    return np.asarray(np.linalg.solve(scaled, rows.T @ target / size) / size)
