"""Find the stretch that the baseline predicts worst, and simulate the models there.

Simulations are of 1 s each, under the measured torque.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.fit.fitted_model import model_of_run
from pipelines.diagnosis.fit.validation import ValidationResult
from pipelines.diagnosis.fit.validation_error import scored
from pipelines.dynamics.replay import WINDOW_S, replay
from pipelines.errors import ExoidError


@dataclass(frozen=True)
class Stretch:
    """A stretch of a validation run."""

    run: int
    begin: float
    """s."""
    end: float

    def within(self, time: NDArray) -> slice:
        """Return the stretch's place among times.

        Parameters
        ----------
        time : (n,) array
            Increasing, s.

        Returns
        -------
        slice
            Into the times.
        """
        first, last = np.searchsorted(time, [self.begin, self.end])
        return slice(int(first), int(last))


def worst_stretch(d: Diagnosis) -> Stretch:
    """Return the stretch with the largest residual, in units of each joint's noise floor."""
    return max(_stretches(d), key=lambda pair: pair[0])[1]


def _stretches(d: Diagnosis) -> Iterator[tuple[float, Stretch]]:
    # Length of the stretch, s.
    stretch_s = 6.0
    # Time between the starts of successive stretches, s.
    step_s = 0.5
    for number, (run, residual) in enumerate(zip(d.validate, d.before.residuals, strict=True)):
        # Blocks near reversals are left out: no fit uses them.
        square = np.sum((residual[:, : len(d.floor_rms)] / d.floor_rms) ** 2, axis=1) * scored(run)
        # A difference of cumulated sums is the sum over a stretch.
        total = np.concatenate([[0.0], np.cumsum(square)])
        # A run that is shorter than a stretch is one stretch.
        last = max(run.time[-1] - stretch_s, run.time[0])
        for begin in np.arange(run.time[0], last + step_s, step_s):
            inside = np.searchsorted(run.time, [begin, begin + stretch_s])
            yield (
                float(np.diff(total[inside])[0]),
                Stretch(number, float(begin), float(begin + stretch_s)),
            )


def simulated_error(
    validated: ValidationResult, d: Diagnosis, stretch: Stretch
) -> tuple[NDArray, NDArray] | None:
    """Simulate a stretch in consecutive 1 s windows, and return the angle errors.

    Parameters
    ----------
    validated : ValidationResult
    d : Diagnosis
    stretch : Stretch

    Returns
    -------
    (k,) array and (k, J) array, or None
        Times, s, and errors, rad, with NaN between two windows. None where the model cannot be
        simulated: the forward dynamics cannot combine its causes, or its mass matrix is that of no
        leg.
    """
    run = d.validate[stretch.run]
    try:
        result = replay(model_of_run(validated.fit, d.baseline, run), run.motion, every_s=WINDOW_S)
    except (ExoidError, ZeroDivisionError):
        return None
    if not np.all(np.isfinite(result.error)):
        return None
    length = result.error.shape[1]
    first, last = result.first, result.first + length - 1
    times = run.motion.time
    # Windows that only overlap the stretch are drawn too.
    shown = (times[last] > stretch.begin) & (times[first] < stretch.end)
    # Each window starts again from the record, so NaN breaks the line before it.
    time = np.pad(
        times[first[shown, np.newaxis] + np.arange(length)],
        ((0, 0), (0, 1)),
        constant_values=np.nan,
    )
    error = np.pad(result.error[shown], ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
    return time.ravel(), error.reshape(-1, error.shape[2])
