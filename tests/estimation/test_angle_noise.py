"""Noise of the angles is told from motion by the torque that it does not take."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from pipelines.contracts import MOTION, parquet
from pipelines.contracts.table import Table
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.estimation.angle_noise import is_loud
from pipelines.identification.two_step import identify
from pipelines.mechanics import run
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.mechanics.read import read_runs
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.sessions import recordings, session

NOISE_RAD, BAND_HZ = 2e-3, (7.0, 12.0)
"""Of a loose encoder: accelerations that would take several N·m."""


@pytest.fixture(scope="module")
def tables():
    """Runs of a leg with nothing hidden, whose encoders shake on their mounts."""
    rng, made = np.random.default_rng(7), []
    for table in recordings(seconds=40.0)[:2]:
        band = butter(2, BAND_HZ, "bandpass", fs=200.0, output="sos")
        noise = sosfilt(band, rng.normal(size=(len(table.frame) + 400, 2)), axis=0)[400:]
        names = ["hip_angle_rad", "knee_angle_rad"]
        frame = table.frame.copy()
        frame[names] += noise / noise.std() * NOISE_RAD
        made.append(motion_table(Table(frame, table.metadata), FilterSettings()))
    return made


@pytest.fixture(scope="module")
def shaken(tables):
    return [
        replace(motion_from_table(table), file=f"run_{number}.parquet")
        for number, table in enumerate(tables)
    ]


def trained(motions):
    return [motion for motion in motions if motion.purpose == "train"]


def test_accelerations_that_take_no_torque_are_noise(shaken):
    assert is_loud(trained(shaken))


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        (None, {}),
        pytest.param(
            "joint_elasticity", {"stiffness": 150.0, "hardening": 0.0}, marks=pytest.mark.slow
        ),
        ("backlash", {"play": 0.03}),
    ],
)
def test_the_motion_of_a_leg_takes_torque_however_it_rings(effect, values):
    assert not is_loud(trained(session(effect, "knee", **values)))


def test_no_cause_is_named_for_what_shaking_encoders_do_and_the_reader_is_warned(shaken):
    found = diagnose(shaken)
    assert found.causes == ()
    assert found.data.noisy_angles
    assert any("the angles are mostly noise" in caveat for caveat in verdict(found)["caveats"])


def test_underestimated_inertia_is_reported_with_a_remedy(shaken):
    found = identify(shaken)
    assert "Set filter.cutoff_hz = 5" in found.angle_noise[0]
    truth = identify(session()[:2])
    assert truth.angle_noise == []
    inertia = [made.parameters["value"][0] for made in (found, truth)]
    assert inertia[0] < 0.7 * inertia[1]


def test_a_run_read_piece_by_piece_is_judged_like_one_in_memory(tables, tmp_path, monkeypatch):
    for module, name in ((parquet, "ROWS"), (run, "WINDOW")):
        monkeypatch.setattr(module, name, 1009)
    MOTION.write(tmp_path / "train.parquet", tables[0].frame, tables[0].metadata)
    runs = read_runs([tmp_path / "train.parquet"], FilterSettings(), None)
    assert len(list(runs[0].pieces(40))) > 5
    assert is_loud(runs)
