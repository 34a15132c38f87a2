"""Whether a wearer's rhythm is the motion's own: then whatever goes with the motion is in its place.

An unknown law of the motion has its lines at multiples of the excitation's frequency, and a sine there takes what
other causes leave of it: beside them such a rhythm mends their form, and nobody need have pushed. Alone it may be
named, for a wearer can fall in with the machine.
"""

from collections.abc import Sequence

from pipelines.diagnosis.candidates import Candidate
from pipelines.diagnosis.observations import Run

DRIFT = 0.1
"""Turns by which a rhythm may drift against a multiple of the motion's over a whole run and pass for it.

A rhythm of the wearer's own does so by chance in 1 of 30 cases where six periods are recorded."""


def shadows_motion(causes: Sequence[Candidate], runs: Sequence[Run]) -> bool:
    """Tell whether a rhythm at a multiple of the motion's frequency stands beside other causes."""
    several = len({cause.label for cause in causes}) > 1
    return several and any(_is_of_motion(cause, runs) for cause in causes)


def _is_of_motion(cause: Candidate, runs: Sequence[Run]) -> bool:
    """Tell whether a cause is a rhythm that in every run in which it acts is a multiple of the motion's own."""
    at = next((i for i, p in enumerate(cause.effect.shape) if p.unit == "Hz"), None)
    acting = [r for r, run in enumerate(runs) if run.motion.run in cause.effect.acts_in]
    return at is not None and all(_is_multiple(cause.shapes[r][at], runs[r]) for r in acting)


def _is_multiple(frequency_hz: float, run: Run) -> bool:
    period = run.motion.period_s
    if not period or not len(run.time):
        return False
    multiple = round(frequency_hz * period) / period
    return abs(frequency_hz - multiple) * float(run.time[-1] - run.time[0]) < DRIFT
