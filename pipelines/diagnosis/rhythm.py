"""Whether a wearer's rhythm is the motion's own: then whatever goes with the motion is in its place.

An unknown law of the motion has its lines at multiples of the excitation's frequency, and a sine there takes what
other causes leave of it, or a little of all of it: nobody need have pushed. Alone, and where it explains most of
what is missing, it may be named, for a wearer can fall in with the machine.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates import Candidate
from pipelines.diagnosis.fit import Fit
from pipelines.diagnosis.observations import Run
from pipelines.effects import VoluntaryTorque

DRIFT = 0.1
"""Turns by which a rhythm may drift against a multiple of the motion's over a whole run and pass for it.

A rhythm of the wearer's own does so by chance in 1 of 30 cases where six periods are recorded."""
MOST_LEFT = 0.5
"""Share of the power above the floor that a rhythm of the motion's own may leave and be named."""


def shadows_motion(made: Fit, before: NDArray, floor: NDArray, runs: Sequence[Run]) -> bool:
    """Tell whether a rhythm at a multiple of the motion's frequency stands beside other causes or explains little.

    ``before`` and ``floor`` (O,) N·m are the rms error without any cause, and of that what is noise.
    """
    if not any(_is_of_motion(cause, runs) for cause in made.causes):
        return False
    was, left = (np.nansum(np.maximum((rms / floor) ** 2 - 1.0, 0.0)) for rms in (before, made.rms))
    return len({cause.label for cause in made.causes}) > 1 or bool(left > MOST_LEFT * was)


def _is_of_motion(cause: Candidate, runs: Sequence[Run]) -> bool:
    """Tell whether a cause is a rhythm that in every run in which it acts is a multiple of the motion's own."""
    if not isinstance(cause.effect, VoluntaryTorque):
        return False
    at = [p.name for p in cause.effect.shape].index("frequency")
    acting = [(shape, run) for shape, run in zip(cause.shapes, runs, strict=True) if cause.effect.explains(run.motion)]
    return bool(acting) and all(_is_multiple(shape[at], run) for shape, run in acting)


def _is_multiple(frequency_hz: float, run: Run) -> bool:
    period = run.motion.period_s
    if not period or not len(run.time):
        return False
    multiple = round(frequency_hz * period) / period
    return abs(frequency_hz - multiple) * float(run.time[-1] - run.time[0]) < DRIFT
