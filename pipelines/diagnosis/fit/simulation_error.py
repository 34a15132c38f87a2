"""Measure how far simulations of 1 s drift from the recorded angles."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.fitted_model import model_of_run
from pipelines.diagnosis.fit.joint_fit import Fit
from pipelines.dynamics.replay import WINDOW_S, replay
from pipelines.errors import ExoidError


def simulation_error(fit: Fit, runs: Sequence[Run], baseline: Baseline) -> NDArray | None:
    """Return the rms angle error of consecutive 1 s simulations over all runs.

    Parameters
    ----------
    fit : Fit
    runs : sequence of Run
    baseline : Baseline

    Returns
    -------
    (J,) array or None
        rad; None where the forward dynamics cannot simulate the fitted model, or diverge.
    """
    squares, count = 0.0, 0
    for run in runs:
        try:
            result = replay(model_of_run(fit, baseline, run), run.motion, WINDOW_S, WINDOW_S)
        except (ExoidError, ZeroDivisionError):
            return None
        # Angles of a simulation that diverges overflow; the result is then None.
        with np.errstate(over="ignore"):
            squares = squares + np.sum(result.error**2, axis=(0, 1))
        count += result.error.shape[0] * result.error.shape[1]
    with np.errstate(invalid="ignore"):
        rms = np.sqrt(squares / max(count, 1))
    return rms if np.all(np.isfinite(rms)) else None
