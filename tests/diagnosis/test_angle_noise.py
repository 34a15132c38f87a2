"""Noise of the angles is told from motion by the torque that it does not take."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from pipelines.contracts.table import Table
from pipelines.diagnosis.angle_noise import is_loud
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.observations import observe
from pipelines.diagnosis.verdict import verdict
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.sessions import recordings, session

NOISE_RAD, BAND_HZ = 2e-3, (7.0, 12.0)
"""Of a loose encoder: accelerations that would take several N·m."""


@pytest.fixture(scope="module")
def shaken():
    """A leg with nothing hidden, whose encoders shake on their mounts."""
    rng, motions = np.random.default_rng(7), []
    for number, table in enumerate(recordings()[:2]):
        band = butter(2, BAND_HZ, "bandpass", fs=200.0, output="sos")
        noise = sosfilt(band, rng.normal(size=(len(table.frame) + 400, 2)), axis=0)[400:]
        names = ["hip_angle_rad", "knee_angle_rad"]
        frame = table.frame.copy()
        frame[names] += noise / noise.std() * NOISE_RAD
        motion = motion_from_table(motion_table(Table(frame, table.metadata), FilterSettings()))
        motions.append(replace(motion, file=f"run_{number}.parquet"))
    return motions


def trained(motions):
    return [observe(motion) for motion in motions if motion.purpose == "train"]


def test_accelerations_that_take_no_torque_are_noise(shaken):
    assert is_loud(trained(shaken))


@pytest.mark.parametrize(
    ("effect", "values"),
    [(None, {}), ("joint_elasticity", {"stiffness": 150.0, "hardening": 0.0}), ("backlash", {"play": 0.03})],
)
def test_the_motion_of_a_leg_takes_torque_however_it_rings(effect, values):
    assert not is_loud(trained(session(effect, "knee", **values)))


def test_no_cause_is_named_for_what_shaking_encoders_do_and_the_reader_is_warned(shaken):
    found = diagnose(shaken)
    assert found.causes == ()
    assert found.noisy_angles
    assert any("no torque goes with" in caveat for caveat in verdict(found)["caveats"])
