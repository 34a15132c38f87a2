"""Downsample fast recordings: motion below 20 Hz does not need a kilohertz."""

from dataclasses import replace
from typing import Any

from pipelines.estimation.regression import block_average
from pipelines.mechanics.motion import Motion
from pipelines.signals.blocks import BlockAverage


def downsampled(motion: Motion) -> Motion:
    """Return the motion at a lower rate.

    Parameters
    ----------
    motion : Motion
        n samples.

    Returns
    -------
    Motion
        Averaged to 200 Hz or a little more; unchanged if slower.
    """
    # Rate down to which neighbouring samples are averaged.
    enough_hz = 200.0
    every = BlockAverage(int(motion.sample_rate_hz // enough_hz))
    if every.decimation < 2:
        return motion
    motion = motion.with_readings_between()
    starts = every.starts(motion.segment)
    averaged: dict[str, Any] = {
        name: every.mean(getattr(motion, name), starts)
        for name in ("time", "q", "dq", "ddq", "torque", "forces", "reference", "temperature")
        if getattr(motion, name) is not None
    }
    # A mean of readings is no reading: it lies between the encoder's counts.
    if motion.measured_angle is not None:
        averaged["measured_angle"] = motion.measured_angle[starts + every.decimation // 2]
    # The regression filter lasts as long as before, in samples of the lower rate.
    blocks = BlockAverage(max(1, round(block_average(motion).decimation / every.decimation)))
    rate = motion.sample_rate_hz / every.decimation
    return replace(
        motion,
        **averaged,
        segment=motion.segment[starts],
        valid=every.all(motion.valid, starts),
        sequence=None if motion.sequence is None else motion.sequence[starts],
        sample_rate_hz=rate,
        load=None,
        limb_load=None,
        body=None,
        limb_body=None,
        metadata={**motion.metadata, "regression_filter": blocks.as_metadata(rate)},
    )
