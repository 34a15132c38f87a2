"""A recording at a kilohertz says what it says at 200 Hz, and is diagnosed as such."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.diagnosis.evidence.downsampling import downsampled
from pipelines.diagnosis.evidence.observed_run import observe
from tests.diagnosis.sessions import session

RATE_HZ = 1000.0


@pytest.fixture(scope="module")
def fast():
    """A motion between whose samples four more are put, on the lines that join them; noise is on
    the torque alone."""
    slow = session()[3]
    time = np.arange(5 * len(slow)) / RATE_HZ
    at = {
        name: np.column_stack(
            [np.interp(time, slow.time, column) for column in getattr(slow, name).T]
        )
        for name in ("q", "dq", "ddq")
    }
    torque = np.repeat(slow.torque, 5, axis=0) + np.random.default_rng(0).normal(
        size=(len(time), 2)
    )
    forces = np.repeat(slow.forces, 5, axis=0)
    blocks = {**slow.metadata["regression_filter"], "decimation": 25}
    return replace(
        slow,
        time=time,
        **at,
        torque=torque,
        forces=forces,
        segment=np.repeat(slow.segment, 5),
        valid=np.repeat(slow.valid, 5),
        sample_rate_hz=RATE_HZ,
        sequence=None,
        reference=None,
        measured_angle=None,
        temperature=None,
        metadata={**slow.metadata, "regression_filter": blocks},
    )


def test_a_kilohertz_becomes_200_hz_and_the_blocks_last_as_long_as_before(fast):
    thin = downsampled(fast)
    assert thin.sample_rate_hz == 200.0
    assert len(thin) == len(fast) // 5
    before, after = observe(fast), observe(thin)
    assert_allclose(after.time, before.time, atol=1e-9)
    assert_allclose(after.measured[:, :2], before.measured[:, :2], atol=1e-9)
    # The cuffs' torque also depends on the angle, which moves 2 ms within an average.
    assert_allclose(after.measured[:, 2:], before.measured[:, 2:], atol=1e-4)
    assert_allclose(after.state[0], before.state[0], atol=1e-9)


def test_forces_that_were_read_with_each_set_point_alone_are_there_at_200_hz(fast):
    forces = np.full_like(fast.forces, np.nan)
    forces[2::5] = fast.forces[2::5]
    thin, whole = downsampled(replace(fast, forces=forces)), downsampled(fast)
    assert np.isfinite(thin.forces[1:-1]).all()
    apart = np.sqrt(np.mean((thin.forces - whole.forces)[1:-1] ** 2))
    assert apart < 0.05 * whole.forces.std()


def test_the_angle_as_it_was_read_keeps_the_counts_of_its_encoder(fast):
    count = 1e-3
    read = count * np.round(fast.q / count)
    thin = downsampled(replace(fast, measured_angle=read))
    assert_allclose(thin.measured_angle, read[2::5])
    assert np.abs(thin.measured_angle - thin.q).max() <= 0.5 * count + 1e-9


def test_a_slow_recording_is_left_as_it_is(fast):
    thin = downsampled(fast)
    assert downsampled(thin) is thin


def test_no_average_reaches_across_a_gap(fast):
    segment = np.zeros(len(fast), dtype=np.int64)
    segment[1003:] = 1
    time = fast.time + 0.5 * segment
    thin = downsampled(replace(fast, segment=segment, time=time))
    spread = np.diff(thin.time)
    assert np.count_nonzero(spread > 0.4) == 1
    assert not np.any((thin.time > fast.time[1002] + 0.002) & (thin.time < time[1003]))
