"""Reduce a run to the rate of its blocks, at which columns of slow effects cost a fifth.

Blocks of 25 ms follow motion below 12 Hz. The difference to columns at the full rate is a small
share of the column itself (measured in tests/diagnosis/test_block_rate.py).
"""

from dataclasses import replace

import numpy as np

from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.signals.blocks import BlockAverage


def at_block_rate(run: Run) -> Run:
    """Return the run with one sample a block, so that its columns are computed once a block."""
    motion, (q, dq, ddq) = run.motion, run.state
    joints = len(motion.joints)
    rate_hz = motion.sample_rate_hz / run.block.decimation
    block = BlockAverage(1)
    # Highest cutoff, as a share of the rate. A motion filtered above it moves no faster at this
    # rate.
    highest_cutoff = 0.4
    slow = replace(
        motion,
        time=run.time,
        q=q,
        dq=dq,
        ddq=ddq,
        torque=run.measured[:, :joints],
        segment=motion.segment[run.starts],
        valid=run.valid,
        sample_rate_hz=rate_hz,
        cutoff_hz=min(motion.cutoff_hz, highest_cutoff * rate_hz),
        load=None if motion.load is None else run.average(motion.load),
        limb_load=None if motion.limb_load is None else run.average(motion.limb_load),
        temperature=None
        if motion.temperature is None
        else run.average(motion.interpolated_temperature),
        forces=None
        if motion.held_forces is None
        else run.average(np.nan_to_num(motion.held_forces)),
        reference=None,
        measured_angle=None,
        sequence=None,
        metadata={**motion.metadata, "regression_filter": block.as_metadata(rate_hz)},
    )
    # Blocks of one sample: the averages must not be taken a second time.
    return replace(run, motion=slow, block=block, starts=np.arange(len(run.time)), fast=None)
