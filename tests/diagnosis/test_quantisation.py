"""A torque reported in coarse steps: the step is found below noise, and called something in the
sensor."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.candidates.quantisation import coarse_step, rounding
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.candidate_table import candidates
from pipelines.diagnosis.verdict.verdict import verdict
from tests.diagnosis.sessions import session

LABEL = "law:quantisation@hip"


def reported_in_steps(step, seed, noise=0.5):
    """Return a session whose hip's torque is rounded before its noise comes, as a drive's coarse
    current loop does."""
    motions = session(seed=seed)
    rng = np.random.default_rng(seed)
    reported = []
    for motion in motions:
        torque = motion.torque.copy()
        torque[:, 0] += rounding(torque[:, 0], step)
        torque[:, 0] += rng.normal(0.0, noise, len(torque))
        reported.append(replace(motion, torque=torque))
    return reported


def test_rounding_takes_a_torque_to_the_nearest_multiple():
    torque = np.array([-2.6, -0.4, 0.0, 0.9, 1.1])
    np.testing.assert_allclose(torque + rounding(torque, 2.0), [-2.0, 0.0, 0.0, 0.0, 2.0])


@pytest.mark.parametrize("step", [1.5, 3.0, 7.0])
def test_the_step_is_found_below_noise_that_came_after_it(step):
    """No value lies on a grid, and the noise is as large as what rounding adds to the smallest
    step."""
    rng = np.random.default_rng(1)
    torque = 12.0 * np.sin(np.linspace(0.0, 40.0, 8000)) + 4.0 * np.sin(
        np.linspace(0.0, 91.0, 8000)
    )
    residual = rounding(torque, step) + rng.normal(0.0, 0.45, len(torque))
    estimate = coarse_step(
        [torque[:4000], torque[4000:]], [residual[:4000], residual[4000:]], float(np.std(torque))
    )
    assert estimate == pytest.approx(step, rel=0.02)


def test_a_residual_that_is_always_zero_has_no_step():
    torque = np.linspace(-10.0, 10.0, 5000)
    assert coarse_step([torque], [np.zeros(5000)], 5.0) is None
    assert coarse_step([np.zeros(5000)], [np.ones(5000)], 0.0) is None


def test_the_step_of_a_torque_that_never_comes_near_zero_is_found():
    """A lift holds its weight all along."""
    torque = 80.0 + 5.0 * np.sin(np.linspace(0.0, 90.0, 8000))
    assert coarse_step([torque], [rounding(torque, 3.0)], 3.5) == pytest.approx(3.0, rel=0.02)


@pytest.mark.slow
def test_a_step_far_from_zero_is_found_in_little_memory():
    rng = np.random.default_rng(2)
    torque, step = 2000.0 + rng.normal(size=4000), 0.7
    tracemalloc.start()
    estimate = coarse_step([torque], [rounding(torque, step)], 1.0)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert estimate == pytest.approx(step, rel=0.02)
    assert most < 1e8


def test_a_torque_that_hardly_varies_about_its_mean_has_no_step():
    rng = np.random.default_rng(3)
    torque = 1.0 + 1e-5 * rng.normal(size=4000)
    assert coarse_step([torque], [rounding(torque, 5e-6)], 1e-5) is None


def with_spikes_that_do_not_count(motions):
    """Return motions with spikes in a tenth of their samples, all of them marked as invalid."""
    spoilt = []
    for motion in motions:
        torque, valid = motion.torque.copy(), motion.valid.copy()
        bad = np.arange(len(torque)) % 200 < 20
        torque[bad, 0] += 300.0 * np.sign(torque[bad, 0])
        spoilt.append(replace(motion, torque=torque, valid=valid & ~bad))
    return spoilt


@pytest.mark.parametrize(
    "seen",
    [
        with_spikes_that_do_not_count,
        pytest.param(lambda motions: motions, marks=pytest.mark.slow),
    ],
    ids=["beside samples that do not count", "alone"],
)
def test_a_torque_in_coarse_steps_is_something_in_the_sensor(seen):
    diagnosis = diagnose(seen(reported_in_steps(4.0, seed=11)))
    outcome, first = verdict(diagnosis), candidates(diagnosis).iloc[0]
    assert outcome["status"] == "unknown_cause"
    assert (first["causes"], first["verdict"]) == ([LABEL], "unlisted")
    (finding,) = outcome["findings"]
    assert (finding["joint"], finding["family"]) == ("hip", "sensor")
    assert finding["laws"][0]["words"] == "a torque of the hip that is reported in coarse steps"
    assert outcome["posterior"]["laws"][LABEL] > 0.95


@pytest.mark.slow
def test_steps_that_the_noise_covers_are_nothing():
    """1.5 N·m are within those that are sought; noise of 3 N·m is seven times what their rounding
    adds."""
    outcome = verdict(diagnose(reported_in_steps(1.5, seed=11, noise=3.0)))
    assert outcome["status"] == "nothing_missing"
    assert outcome["posterior"]["laws"].get(LABEL, 0.0) < 0.05
