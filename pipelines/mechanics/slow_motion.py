"""What a motion holds below a cut-off lower than its own."""

from dataclasses import replace

import numpy as np

from pipelines.mechanics.motion import Motion
from pipelines.signals.low_pass import derivative, low_pass, shortest

EDGE_PERIODS = 1.5
"""Periods of the cut-off at each end of a stretch that the filter lacks one side of."""


def edge(rate_hz: float, cutoff_hz: float) -> int:
    """Return the samples at each end of a stretch that the filter lacks one side of."""
    return int(np.ceil(EDGE_PERIODS * rate_hz / cutoff_hz))


def below(motion: Motion, cutoff_hz: float) -> Motion:
    """Return what a motion holds below a cut-off; it must have been faster."""
    rate = motion.sample_rate_hz
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    valid = motion.valid.copy()
    unsure = edge(rate, cutoff_hz)
    for stretch in motion.segments():
        if stretch.stop - stretch.start < shortest(rate, cutoff_hz):
            valid[stretch] = False
            continue
        q[stretch] = low_pass(motion.q[stretch], rate, cutoff_hz)
        dq[stretch], ddq[stretch] = (derivative(q[stretch], rate, order) for order in (1, 2))
        valid[stretch.start : stretch.start + unsure] = False
        valid[max(stretch.start, stretch.stop - unsure) : stretch.stop] = False
    return replace(
        motion, q=q, dq=dq, ddq=ddq, valid=valid, cutoff_hz=cutoff_hz,
        # What a fit to the faster motion estimated is not that of this one.
        load=None, limb_load=None, body=None, limb_body=None,
    )  # fmt: skip
