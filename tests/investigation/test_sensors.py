"""Sensors that could be added separate what their equations say, and what recordings confirm."""

import numpy as np
import pytest

from pipelines.design.excitation import design
from pipelines.investigation.next_experiments import next_experiments
from pipelines.investigation.planned import PlannedRuns
from pipelines.investigation.rivals import Rival, rivals_named
from pipelines.investigation.sensors import LinkEncoder, TorqueSensor, sensors_for
from pipelines.investigation.separation_problem import SeparationProblem
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import THE_LEG
from pipelines.model import Term
from pipelines.rig.plant import Plant
from pipelines.settings.design import DesignSettings
from pipelines.settings.rig.plant import PlantSettings


def effects(*labels):
    return [one.effect for one in rivals_named(labels, THE_LEG)]


@pytest.mark.parametrize(
    ("sensor", "pair", "apart"),
    [
        # Pairs that no motion separates.
        (TorqueSensor("knee"), ("coulomb_asymmetry@knee", "torque_offset@knee"), False),
        (TorqueSensor("knee"), ("torque_gain@hip", "torque_gain@knee"), True),
        (LinkEncoder("hip"), ("base_tilt", "encoder_offset@hip"), True),
        (LinkEncoder("knee"), ("base_tilt", "encoder_offset@hip"), False),
        # What is in the drive, and what is behind it.
        (TorqueSensor("hip"), ("cogging@hip", "mass_off_axis@hip"), True),
        (TorqueSensor("knee"), ("cogging@hip", "mass_off_axis@hip"), False),
        (TorqueSensor("hip"), ("parallel_spring@hip", "torque_drift@hip"), True),
        (LinkEncoder("knee"), ("backlash@knee", "stribeck_friction@knee"), True),
        (LinkEncoder("hip"), ("cuff_compliance@hip", "joint_elasticity@hip"), True),
    ],
)
def test_a_sensor_separates_what_acts_before_it(sensor, pair, apart):
    assert sensor.separates(*effects(*pair)) is apart


def test_the_second_encoder_shows_that_nothing_is_there_and_the_torque_sensor_does_not():
    backlash, inertia = effects("backlash@knee", "rotor_inertia@knee")
    assert LinkEncoder("knee").separates(backlash, None)
    assert not TorqueSensor("knee").separates(inertia, None)


def shown_at(joint, label):
    """Return whether the drive's encoder of a virtual leg differs from the link's true angle."""
    (effect,) = effects(label, "base_tilt")[:1]
    shape = [p.typical[1] if p.default is None else p.default for p in effect.shape]
    term = Term(effect, np.append([p.typical[1] for p in effect.linear], shape))
    leg = Plant(PlantSettings(), "with_human", seed=1, effects=[term])
    time = np.arange(600)[:, np.newaxis] / leg.sample_rate_hz
    motion = leg.reference + 0.3 * np.sin(3.0 * time) * [1.0, -1.0] * np.minimum(time, 1.0)
    samples = leg.run(motion, np.ones(2, dtype=bool))
    j = ("hip", "knee").index(joint)
    difference = samples.angle[:, j] - samples.truth[:, 0, j]
    return np.abs(difference).max() > 1e-4


@pytest.mark.parametrize("joint", ["hip", "knee"])
@pytest.mark.parametrize(
    "label",
    [
        *(f"{one}@{at}" for one in ("backlash", "joint_elasticity") for at in ("hip", "knee")),
        *("encoder_offset@knee", "encoder_eccentricity@hip"),
        *("parallel_spring@hip", "stribeck_friction@knee", "torque_gain@knee"),
    ],
)
def test_the_encoders_of_a_virtual_leg_differ_where_the_equations_say(label, joint):
    (effect,) = effects(label, "base_tilt")[:1]
    assert shown_at(joint, label) == LinkEncoder(joint).shows(effect)


def test_next_lists_sensors_that_separate_rivals():
    tilt, offset = effects("base_tilt", "encoder_offset@hip")
    rivals = [Rival(tilt, 0.6), Rival(offset, 0.4)]
    settings = DesignSettings(harmonics=3, particles=12, iterations=50)
    usual, runs = (
        design(settings).trajectory,
        PlannedRuns(settings, PlantSettings(), ("exo_alone",)),
    )
    found = next_experiments(SeparationProblem.of(rivals, runs, usual), Geometry(), usual)
    sensors = [one for one in found.experiments if one.what == "sensor"]
    assert [(one.words, one.decides) for one in sensors] == [
        ("add a second encoder on the link of the hip", pytest.approx(1.0))
    ]


def test_each_joint_may_have_each_sensor():
    assert len(sensors_for(THE_LEG)) == 4
