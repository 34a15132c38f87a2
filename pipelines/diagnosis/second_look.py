"""The same runs at a bandwidth where what rings follows its load at once.

A soft or loose transmission swings after every reversal at a few hertz, which no correction of the measured
motion can follow; what it does to the slow motion is hidden under that. Below its resonance it is seen.
"""

from dataclasses import replace

from pipelines.estimation.angle_noise import CUTOFF_HZ
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.slow_motion import below
from pipelines.signals.blocks import BlockAverage

BLOCK_S = 0.1


def slower(motion: Motion) -> Motion:
    """Return the motion filtered to where transmissions follow their loads; it must have been faster."""
    block = BlockAverage.lasting(BLOCK_S, motion.sample_rate_hz)
    told = {**motion.metadata, "regression_filter": block.as_metadata(motion.sample_rate_hz)}
    return replace(below(motion, CUTOFF_HZ), metadata=told)
