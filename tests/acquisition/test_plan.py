import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pipelines.acquisition.plan import make_plan
from pipelines.acquisition.set_points import SetPoints
from pipelines.errors import InputError
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.sampled_trajectory import SampledTrajectory
from pipelines.settings.rig import load_rig

RATE = 200.0
REST = np.zeros(2)


@pytest.fixture
def motion():
    return FourierTrajectory(
        np.array([0.6, -0.9]), np.array([[0.4], [0.5]]), np.array([[0.1], [0.0]]), omega=0.4 * np.pi
    )


def test_set_points_leave_rest_gently_meet_the_motion_at_its_speed_and_come_back(rig_file, motion):
    plan = make_plan(load_rig(rig_file()), motion, REST, 5.0, RATE)
    path = np.vstack([REST, REST, plan.reference, REST, REST])
    speed, acceleration = np.diff(path, axis=0) * RATE, np.diff(path, 2, axis=0) * RATE**2
    assert np.abs(speed).max() < 3.0
    # A jump in speed would be an acceleration of at least 0.1 rad/s in one sample, 20 rad/s².
    assert np.abs(acceleration).max() < 15.0
    instants = (np.arange(1000) + 0.5) / RATE
    assert_allclose(
        np.asarray(plan.reference)[plan.first : plan.stop], motion.at(instants)[0], atol=1e-12
    )


def test_before_the_recording_the_motion_itself_runs_for_the_settling_time(rig_file, motion):
    rig = load_rig(rig_file(settle_s=1.0))
    plan = make_plan(rig, motion, REST, 5.0, RATE)
    before = np.asarray(plan.reference)[plan.first - 200 : plan.first]
    assert_allclose(before, motion.at(np.arange(-200, 0) / RATE + 0.5 / RATE)[0], atol=1e-12)


def test_a_ramp_too_fast_for_a_joint_is_made_longer(rig_file, motion):
    slow = {"speed_rad_s = 3.0": "speed_rad_s = 0.55", "speed_rad_s = 2.2": "speed_rad_s = 0.5"}
    quiet = FourierTrajectory(motion.theta0, 0.1 * motion.a, 0.1 * motion.b, motion.omega)
    plan = make_plan(load_rig(rig_file(replace=slow)), quiet, REST, 5.0, RATE)
    assert np.abs(np.diff(np.asarray(plan.reference)[:, 0])).max() * RATE <= 0.55
    assert plan.first > (0.8 + 0.2) * RATE


def test_a_motion_that_runs_once_is_not_asked_to_repeat(rig_file):
    time = np.arange(0, 2, 0.01)
    q = np.column_stack([0.5 + 0.1 * np.sin(time), -0.8 + 0.1 * np.cos(time)])
    dq, ddq = np.gradient(q, 0.01, axis=0), np.zeros_like(q)
    once = SampledTrajectory(time, q, dq, ddq)
    assert make_plan(load_rig(rig_file()), once, REST, 1.9, RATE).stop > 0
    with pytest.raises(InputError) as caught:
        make_plan(load_rig(rig_file()), once, REST, 3.0, RATE)
    assert (
        str(caught.value)
        == "the trajectory lasts 1.99 s and does not repeat, but the run's duration_s is 3; shorten"
        " the run, or give omega_rad_s"
    )


def test_a_motion_too_fast_for_the_rig_is_refused(rig_file, motion):
    fast = FourierTrajectory(motion.theta0, motion.a, motion.b, omega=8 * np.pi)
    with pytest.raises(InputError) as caught:
        make_plan(load_rig(rig_file()), fast, REST, 5.0, RATE)
    assert "the hip would move at" in str(caught.value)
    assert str(caught.value).endswith(
        "but the rig allows -3 to 3 rad/s; make the excitation slower or smaller: is its"
        " omega_rad_s in rad/s?"
    )


@pytest.mark.parametrize(("a", "b"), [(0.05, 0.0), (0.0, 0.05)])
def test_a_motion_whose_set_points_show_a_standstill_is_refused_for_its_own_speed(rig_file, a, b):
    """One whole turn a sample: the phase is the same at each set-point."""
    alias = FourierTrajectory(
        np.array([0.6, -0.9]),
        np.array([[a], [0.0]]),
        np.array([[b], [0.0]]),
        omega=2 * np.pi * RATE,
    )
    with pytest.raises(
        InputError, match=r"the hip would move at .* which 200 set-points a second do not show"
    ):
        make_plan(load_rig(rig_file()), alias, REST, 5.0, RATE)


def test_a_run_shorter_than_the_period_does_not_let_the_ramps_leave_the_limits(rig_file):
    # The first half of the period keeps the limits; the ramps run the other half, where the hip is
    # at 2 rad.
    half = FourierTrajectory(
        np.array([1.2, -0.9]),
        np.array([[-0.8], [0.1]]),
        np.array([[0.0], [0.0]]),
        omega=0.2 * np.pi,
    )
    rig = load_rig(rig_file(shipped="plain", ramp_s=3.0, settle_s=1.0))
    assert half.at((np.arange(1000) + 0.5) / RATE)[0][:, 0].max() < 1.73
    with pytest.raises(InputError) as caught:
        make_plan(rig, half, REST, 5.0, RATE)
    assert "the hip would be at 1.7" in str(caught.value)
    assert "on the way into the run, but the rig allows -0.35 to 1.75 rad" in str(caught.value)


def test_set_points_that_are_computed_as_they_come_due_are_those_that_were_checked(
    rig_file, motion, monkeypatch
):
    monkeypatch.setattr("pipelines.acquisition.set_points.PIECE", 64)
    reference = make_plan(load_rig(rig_file()), motion, REST, 5.0, RATE).reference
    every = np.asarray(reference)
    assert every.shape == (len(reference), 2)
    assert_array_equal(np.array([reference[k] for k in range(len(reference))]), every)
    pieces = list(reference.pieces())
    assert_array_equal(np.vstack([piece[k > 0 :] for k, (_, piece) in enumerate(pieces)]), every)
    assert [first for first, _ in pieces] == [max(64 * k - 1, 0) for k in range(len(pieces))]


def test_the_plan_of_an_hour_takes_no_more_memory_than_that_of_a_minute(rig_file, motion):
    peaks = []
    for duration_s in (60.0, 3600.0):
        tracemalloc.start()
        make_plan(load_rig(rig_file()), motion, REST, duration_s, 1000.0)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]


def test_set_points_are_computed_once_though_the_last_one_is_asked_for_again():
    """While the leg moves no cycle may wait for what an earlier one computed already."""
    computed = []

    def run(begin, end):
        computed.append(end - begin)
        return np.arange(begin, end, dtype=float)[:, np.newaxis]

    points = SetPoints(np.zeros((0, 1)), run, 5000, np.zeros((0, 1)))
    for k in range(4999):
        asked = (max(k - 1, 0), k, k + 1)
        assert tuple(points[i][0] for i in asked) == asked
    assert sum(computed) < 2 * 5000
