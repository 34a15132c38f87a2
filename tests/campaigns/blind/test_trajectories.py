"""Motions keep the paper's bounds, are what they say, and repeat where they say so."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.campaigns.blind.excitation import FASTEST, HIGHEST, LOWEST, STEEPEST
from tests.campaigns.blind.loop import LEAD_IN_S, tabulated
from tests.campaigns.blind.trajectories import FAMILIES, random_trajectory

SEED = 900_600
LENGTH_S = 40.0
STEP_S = 0.002


@pytest.fixture(params=[(family, periodic) for family in FAMILIES for periodic in (True, False)])
def drawn(request):
    family, periodic = request.param
    return random_trajectory(np.random.default_rng(SEED), LENGTH_S, periodic, family), periodic


def test_motions_keep_table_2_and_are_fast_enough_to_be_of_use(drawn):
    q, dq, ddq = drawn[0].at(np.arange(0.0, LENGTH_S, STEP_S))
    assert np.all(q >= LOWEST) and np.all(q <= HIGHEST)
    assert np.abs(dq).max() <= FASTEST and np.abs(ddq).max() <= STEEPEST
    assert np.all(np.sqrt(np.mean(dq**2, axis=0)) > 0.08)


def test_velocity_and_acceleration_are_derivatives(drawn):
    q, dq, ddq = drawn[0].at(np.arange(0.0, LENGTH_S, STEP_S))
    inner = slice(5, -5)
    assert_allclose(np.gradient(q, STEP_S, axis=0)[inner], dq[inner], atol=2e-3)
    assert_allclose(np.gradient(dq, STEP_S, axis=0)[inner], ddq[inner], atol=0.08)


def test_a_motion_repeats_with_its_period_or_does_not(drawn):
    motion, periodic = drawn
    t = np.arange(0.0, 10.0, 0.05)
    if periodic:
        assert 2.0 < motion.period_s <= 20.0
        assert_allclose(motion.at(t)[0], motion.at(t + motion.period_s)[0], atol=1e-9)
    else:
        assert motion.period_s is None
        shifts = np.arange(2.0, 25.0, 0.1)
        span = np.ptp(motion.at(t)[0], axis=0)
        apart = [np.abs(motion.at(t)[0] - motion.at(t + s)[0]).max(axis=0) for s in shifts]
        assert np.all(np.min(np.max(np.array(apart) / span, axis=1)) > 0.02)


def test_a_table_is_the_motion_to_within_a_count(drawn):
    motion = drawn[0]
    t = np.random.default_rng(SEED).uniform(-LEAD_IN_S, LENGTH_S, 300)
    table = motion.table(LENGTH_S)
    tabulated_motion = [[tabulated(table, at, j) for j in (0, 1)] for at in t]
    assert_allclose(tabulated_motion, motion.at(t)[0], atol=5e-5)


def test_the_papers_hip_is_one_sine():
    motion = random_trajectory(np.random.default_rng(SEED), 60.0, True, "paper")
    t = np.arange(0.0, 4 * motion.period_s, motion.period_s / 400)[:1600]
    lines = np.abs(np.fft.rfft(motion.at(t)[0] - motion.middle, axis=0))
    hip, knee = np.sort(lines, axis=0).T
    assert hip[-2] < 0.01 * hip[-1]
    assert knee[-2] > 0.2 * knee[-1]
