"""The same runs at a bandwidth where what rings follows its load at once.

A soft or loose transmission swings after every reversal at a few hertz, which no correction of the measured
motion can follow; what it does to the slow motion is hidden under that. Below its resonance it is seen.
"""

from dataclasses import replace

import numpy as np

from pipelines.mechanics.motion import Motion
from pipelines.signals.blocks import BlockAverage
from pipelines.signals.low_pass import derivative, low_pass, shortest

CUTOFF_HZ = 5.0
BLOCK_S = 0.1
EDGE_PERIODS = 1.5
"""Periods of the cut-off at each end of a stretch that the filter lacks one side of."""


def slower(motion: Motion) -> Motion:
    """Return the motion filtered to where transmissions follow their loads; it must have been faster."""
    block = BlockAverage.lasting(BLOCK_S, motion.sample_rate_hz)
    told = {**motion.metadata, "regression_filter": block.as_metadata(motion.sample_rate_hz)}
    return replace(below(motion, CUTOFF_HZ), metadata=told)


def below(motion: Motion, cutoff_hz: float) -> Motion:
    """Return what a motion holds below a cut-off; it must have been faster."""
    rate = motion.sample_rate_hz
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    valid = motion.valid.copy()
    edge = int(np.ceil(EDGE_PERIODS * rate / cutoff_hz))
    for stretch in motion.segments():
        if stretch.stop - stretch.start < shortest(rate, cutoff_hz):
            valid[stretch] = False
            continue
        q[stretch] = low_pass(motion.q[stretch], rate, cutoff_hz)
        dq[stretch], ddq[stretch] = (derivative(q[stretch], rate, order) for order in (1, 2))
        valid[stretch.start : stretch.start + edge] = False
        valid[max(stretch.start, stretch.stop - edge) : stretch.stop] = False
    return replace(
        motion, q=q, dq=dq, ddq=ddq, valid=valid, cutoff_hz=cutoff_hz,
        # What a fit to the faster motion estimated is not that of this one.
        load=None, limb_load=None, body=None, limb_body=None,
    )  # fmt: skip
