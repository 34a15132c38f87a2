"""A spring that is no straight line is a spring, a drag that is no square a drag, and nothing is named for the bend."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts.table import Table
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict import verdict
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.machines import driven
from tests.diagnosis.sessions import recordings

LAWS = {
    "a cable that only pulls": lambda q: 14.0 * np.maximum(q + 0.9, 0.0),
    "a spring that hardens": lambda q: 4.0 * (q + 0.5) + 10.0 * (q + 0.5) ** 3,
    "a spring that softens": lambda q: 5.0 * np.tanh(2.5 * (q + 0.8)),
}


@pytest.mark.parametrize("stiffness", [pytest.param(5.0, marks=pytest.mark.slow), 7.0])
def test_a_cord_over_both_joints_is_no_mass_that_no_machine_has(stiffness):
    """It pulls as the shank's weight does, and weight has inertia: named for a mass it is as likely as not."""

    def with_cord(table: Table) -> Table:
        frame = table.frame.copy()
        pull = stiffness * (frame["hip_angle_rad"] + frame["knee_angle_rad"] + 0.6)
        frame["hip_torque_nm"] += pull
        frame["knee_torque_nm"] += pull
        return replace(table, frame=frame)

    motions = [motion_from_table(motion_table(with_cord(t), FilterSettings())) for t in recordings(seed=4)]
    found = diagnose([replace(motion, file=f"run_{i}.parquet") for i, motion in enumerate(motions)])
    said = verdict(found)
    assert all(cause["probability"] <= 0.5 for cause in said["causes"])
    assert not said["causes"] or any("no real machine has" in caveat for caveat in said["caveats"])


@pytest.mark.parametrize("law", LAWS)
def test_a_spring_of_any_form_is_named_alone(law):
    def with_spring(table: Table) -> Table:
        frame = table.frame.copy()
        frame["knee_torque_nm"] += LAWS[law](frame["knee_angle_rad"].to_numpy())
        return replace(table, frame=frame)

    motions = [motion_from_table(motion_table(with_spring(t), FilterSettings())) for t in recordings(seed=4)]
    found = diagnose([replace(motion, file=f"run_{i}.parquet") for i, motion in enumerate(motions)])
    assert found.causes == ("parallel_spring@knee",)


def over_a_pulley(t, q, dq, ddq, torque):
    """Return the torque of a balancing spring between a point above the axis and one on the link."""
    return -2.5 * np.sin((q - 0.3) / 1.2) / np.sqrt(1.5 - np.cos((q - 0.3) / 1.2))


def diagnosed(more):
    tables = [driven(p, seed, "revolute", more) for seed, p in enumerate(("train", "train", "validate"), 3)]
    motions = [motion_from_table(motion_table(table, FilterSettings())) for table in tables]
    return diagnose([replace(motion, file=f"run_{i}.parquet") for i, motion in enumerate(motions)])


def test_what_a_bent_spring_would_explain_as_well_is_as_likely_there_as_not():
    causes = verdict(diagnosed(over_a_pulley))["causes"]
    assert [cause["effect"] for cause in causes] == ["parallel_spring", "mass_off_axis"]
    assert causes[0]["probability"] > 0.9
    for beside in causes[1:]:
        assert beside["probability"] < 0.5
        assert any(
            "a spring that hardens, softens or goes slack would explain as much" in e for e in beside["evidence"]
        )


def test_what_no_bent_spring_explains_keeps_its_probability():
    causes = verdict(diagnosed(lambda t, q, dq, ddq, torque: 5.0 * q + 0.9 * np.sin(11.0 * q)))["causes"]
    assert {c["effect"]: c["probability"] > 0.9 for c in causes} == {"parallel_spring": True, "cogging": True}


@pytest.mark.parametrize("power", [1.6, 2.6])
def test_a_drag_of_any_power_of_speed_is_named_alone(power):
    found = diagnosed(lambda t, q, dq, ddq, torque: 0.25 * np.sign(dq) * np.abs(dq) ** power)
    assert found.causes == ("quadratic_drag@arm",)


def ties(more):
    """Return the causes named first and second, and what the first is tied with."""
    causes = verdict(diagnosed(more))["causes"]
    return [c["effect"] for c in causes], {tie["effect"] for tie in causes[0]["indistinguishable_from"]}


def test_a_spring_that_saturates_is_tied_with_the_ripple_of_few_waves_that_bends_so():
    named, tied = ties(lambda t, q, dq, ddq, torque: 3.0 * np.tanh((q - 0.1) / 0.4))
    assert named == ["cogging"] and tied == {"parallel_spring"}


def test_a_damper_that_grips_beyond_a_speed_is_a_drag_that_a_stribeck_peak_imitates():
    named, tied = ties(lambda t, q, dq, ddq, torque: 3.0 * np.sign(dq) * np.maximum(np.abs(dq) - 1.5, 0.0))
    assert named == ["quadratic_drag"] and tied == {"stribeck_friction"}


def test_a_ripple_of_many_waves_is_tied_with_no_spring():
    named, tied = ties(lambda t, q, dq, ddq, torque: 0.8 * np.sin(20.0 * q) + 0.3 * np.sin(40.0 * q + 1.0))
    assert named == ["cogging"] and not tied
