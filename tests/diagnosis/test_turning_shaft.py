"""A shaft that makes many turns: its ripple is found, and it has neither spring nor end stop."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.data_faults.units import angle_unit_faults
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.machines import RATE_HZ, table


def shaft(purpose, seed, seconds=30.0):
    """Return a motion of some 60 turns forward and 20 back, with 12 ripples of 20 mN·m a turn."""
    time, draw = np.arange(0.0, seconds, 1.0 / RATE_HZ), np.random.default_rng(seed)
    phases = draw.uniform(0.0, 2.0 * np.pi, 2)
    waves = 2.0 * np.pi * np.outer(time, 1.0 / np.array([9.0, 3.1])) + phases
    speed = 9.0 + 14.0 * np.sin(waves[:, 0]) + 6.0 * np.sin(waves[:, 1])
    acceleration = np.gradient(speed, time)
    angle = np.cumsum(speed) / RATE_HZ
    torque = 0.002 * acceleration + 0.05 * np.tanh(speed / 0.01) + 0.0008 * speed
    torque += 0.02 * np.sin(12.0 * angle + 0.4) + draw.normal(0.0, 0.004, len(time))
    joint = {"name": "shaft", "kind": "revolute", "turns": True}
    recording = table(time, angle, torque, joint, purpose, gravity_m_s2=0.0)
    del recording.metadata["period_s"]
    motion = motion_from_table(motion_table(recording, FilterSettings()))
    return replace(motion, file=f"{purpose}.parquet")


def test_the_ripple_of_a_shaft_is_found_over_all_its_turns():
    outcome = verdict(diagnose([shaft("train", 1), shaft("validate", 2)]))
    assert outcome["status"] == "explained"
    (cause,) = outcome["causes"]
    assert cause["effect"] == "cogging"
    found = {parameter["name"]: parameter["value"] for parameter in cause["parameters"]}
    assert found["cycles_per_turn"] == pytest.approx(12.0, abs=0.01)
    assert found["amplitude"] == pytest.approx(0.02, rel=0.05)


def test_many_turns_of_a_joint_that_turns_without_end_are_no_wrong_unit():
    assert not [fault for seed in (1, 3) for fault in angle_unit_faults(shaft("train", seed))]
