"""A torque told in coarse steps: the step is found below noise, and told as something in the sensor."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.candidates.quantisation import coarse_step, rounding
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from tests.diagnosis.sessions import session

LABEL = "law:quantisation@hip"


def told_in_steps(step, seed):
    """Return a session whose hip's torque is rounded before its noise comes, as a drive's coarse current loop does."""
    motions = session(seed=seed)
    rng = np.random.default_rng(seed)
    told = []
    for motion in motions:
        torque = motion.torque.copy()
        torque[:, 0] += rounding(torque[:, 0], step)
        torque[:, 0] += rng.normal(0.0, 0.5, len(torque))
        told.append(replace(motion, torque=torque))
    return told


def test_rounding_takes_a_torque_to_the_nearest_multiple():
    torque = np.array([-2.6, -0.4, 0.0, 0.9, 1.1])
    np.testing.assert_allclose(torque + rounding(torque, 2.0), [-2.0, 0.0, 0.0, 0.0, 2.0])


@pytest.mark.parametrize("step", [1.5, 3.0, 7.0])
def test_the_step_is_found_below_noise_that_came_after_it(step):
    """No value lies on a grid, and the noise is as large as what rounding adds to the smallest step."""
    rng = np.random.default_rng(1)
    torque = 12.0 * np.sin(np.linspace(0.0, 40.0, 8000)) + 4.0 * np.sin(np.linspace(0.0, 91.0, 8000))
    residual = rounding(torque, step) + rng.normal(0.0, 0.45, len(torque))
    found = coarse_step([torque[:4000], torque[4000:]], [residual[:4000], residual[4000:]], float(np.std(torque)))
    assert found == pytest.approx(step, rel=0.02)


def test_a_residual_that_goes_against_every_rounding_has_no_step():
    torque = np.linspace(-10.0, 10.0, 5000)
    assert coarse_step([torque], [np.zeros(5000)], 5.0) is None


def test_a_torque_in_coarse_steps_is_something_in_the_sensor():
    said = verdict(diagnose(told_in_steps(4.0, seed=11)))
    assert said["status"] == "unknown_cause"
    (finding,) = said["findings"]
    assert (finding["joint"], finding["family"]) == ("hip", "sensor")
    assert finding["laws"][0]["words"] == "a torque of the hip that is told in coarse steps"
    assert said["posterior"]["laws"][LABEL] > 0.95


def test_steps_finer_than_the_noise_are_nothing():
    said = verdict(diagnose(told_in_steps(0.4, seed=11)))
    assert said["status"] == "nothing_missing"
    assert said["posterior"]["laws"].get(LABEL, 0.0) < 0.05
