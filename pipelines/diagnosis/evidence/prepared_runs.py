"""Fit the baseline alone to the searched runs, and measure its residual and the noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.baseline import Baseline, with_load
from pipelines.diagnosis.evidence.baseline_columns import columns_under, gram_of_runs
from pipelines.diagnosis.evidence.bursts import bursts
from pipelines.diagnosis.evidence.decision_band import DecisionBand
from pipelines.diagnosis.evidence.gram import solve, weights_under
from pipelines.diagnosis.evidence.model_error import varying_torque
from pipelines.diagnosis.evidence.noise_model import NoiseModel, noise_model
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.evidence.order_tracking import JointLines, lines_in
from pipelines.model import Model


@dataclass(frozen=True)
class PreparedRuns:
    """Runs under the baseline alone: the training runs, or all runs where all are searched."""

    runs: tuple[Run, ...]
    """With joint loads computed from the baseline's rigid bodies."""
    baseline: Baseline
    columns: tuple[NDArray, ...]
    """(m, O, b) the baseline's columns in each run."""
    values: NDArray
    """(b,) the baseline fitted alone."""
    weights: NDArray
    """(O,) inverse variances under it."""
    noise: NoiseModel
    torque: NDArray
    """(O,) N·m rms."""
    predicted: tuple[NDArray, ...]
    """(n, J) N·m of each run: the baseline's prediction at the full sampling rate."""
    lines: tuple[JointLines, ...]
    """Of each joint's residual at the full sampling rate."""
    bursts: NDArray
    """(J,) log Bayes factor of bursts in the torque."""

    @property
    def slow_rms(self) -> NDArray:
        """Rms residual of the baseline in the decision band, (O,) N·m; zero for missing outputs."""
        squares, weight = np.zeros(len(self.torque)), np.zeros(len(self.torque))
        for run, residual in zip(self.runs, self.residuals, strict=True):
            band = DecisionBand.of(run)
            squares += np.sum(band.weight * band.average(residual) ** 2, axis=0)
            weight += band.weight.sum(axis=0)
        return np.sqrt(squares / np.maximum(weight, 1.0))

    @property
    def residuals(self) -> list[NDArray]:
        """Measured torque less the baseline's, (m, O) N·m of each run."""
        return [r.measured - c @ self.values for r, c in zip(self.runs, self.columns, strict=True)]


def prepare(runs: Sequence[Run], baseline: Baseline) -> PreparedRuns:
    """Fit the baseline alone, and measure the noise of its residual.

    Parameters
    ----------
    runs : sequence of Run
        The searched runs.
    baseline : Baseline
        Rigid body, friction and known effects.
    """
    columns, weights, values = baseline_fit(runs, baseline)
    # No column of the baseline needs a load, so its bodies are known first.
    loaded = tuple(with_load(run, baseline, values) for run in runs)
    residuals = [r.measured - c @ values for r, c in zip(runs, columns, strict=True)]
    # Errors of the baseline repeat with the motion, so they cancel between periods.
    noise = noise_model(loaded, residuals)
    # Blocks of 25 ms lose lines above 18 Hz, so these are sought at the full rate.
    predicted = _at_full_rate(loaded, baseline, values)
    motions = [run.motion for run in loaded]
    lines = lines_in(
        motions, [motion.torque - x for motion, x in zip(motions, predicted, strict=True)]
    )
    torque = varying_torque(runs, baseline, values)
    return PreparedRuns(
        loaded,
        baseline,
        columns,
        values,
        weights,
        noise,
        torque,
        predicted,
        tuple(lines),
        bursts(loaded, residuals),
    )


def baseline_fit(
    runs: Sequence[Run], baseline: Baseline
) -> tuple[tuple[NDArray, ...], NDArray, NDArray]:
    """Fit the baseline alone to the usable samples of some runs.

    Parameters
    ----------
    runs : sequence of Run
        m blocks of O outputs each.
    baseline : Baseline
        Of b columns.

    Returns
    -------
    tuple of arrays
        Columns of each run (m, O, b), the outputs' inverse variances (O,), and values (b,).
    """
    columns = tuple(columns_under((), run, baseline)[0] for run in runs)
    gram = gram_of_runs(runs, columns)
    weights = weights_under(gram)
    return columns, weights, solve(gram, weights)


def _at_full_rate(runs: Sequence[Run], baseline: Baseline, values: NDArray) -> tuple[NDArray, ...]:
    """Return the baseline's prediction at the full sampling rate, (n, J) N·m of each run."""
    joints, model = len(baseline.joints), Model(baseline.terms)
    return tuple(model.regressor(run.motion, cuffs=True)[:, :joints] @ values for run in runs)
