"""A verdict on an arm of which the torque of one joint was not recorded, though it moves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipelines.diagnosis.detectability.detectability import detectability_of_recorded
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.verdict.candidate_table import candidates
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.errors import InputError
from pipelines.identification import identify
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.sessions import diagnosed, session
from tests.identification.test_unmeasured_joint import COUNT
from tests.identification.test_unmeasured_joint import motions as braked

pytest.importorskip("mujoco")
from tests.diagnosis.planar_arm import TRUTH, planar_arm

STIFFNESS, REST = 6.0, 0.2


@pytest.fixture(scope="module")
def tables():
    return [planar_arm("train", 1), planar_arm("validate", 2)]


def without_torque_of(joint, tables, stiffness=0.0):
    """Return motions without a joint's torque, and with a spring at the shoulder."""
    runs = []
    for table in tables:
        frame = table.frame.copy()
        # A spring changes the torque that this motion takes, and nothing else.
        frame["shoulder_torque_nm"] += stiffness * (frame["shoulder_angle_rad"] - REST)
        frame[f"{joint}_torque_nm"] = np.nan
        joints = [
            entry | ({"drive": "unmeasured"} if entry["name"] == joint else {})
            for entry in table.metadata["joints"]
        ]
        path = Path(f"{table.metadata['purpose']}.parquet")
        changed = replace(
            table, frame=frame, metadata=table.metadata | {"joints": joints}, path=path
        )
        runs.append(motion_from_table(motion_table(changed, FilterSettings())))
    return runs


@pytest.fixture(scope="module")
def plain(tables):
    return without_torque_of("elbow", tables)


@pytest.fixture(scope="module")
def diagnosis(plain):
    return diagnose(plain)


def test_the_bodies_follow_from_the_shoulder_alone(plain):
    found = identify(plain)
    table = found.parameters
    assert list(table["name"]) == ["X1", "X2", "X3", "coulomb", "viscous"]
    assert np.allclose(table["value"][:3], TRUTH[:3], rtol=0.03)
    assert np.allclose(table["value"][3:], TRUTH[3:5], rtol=0.08)
    assert (found.collinear, found.unrealizable) == ([], [])


def test_of_the_elbow_alone_follow_the_parameters_of_its_own_equation(tables):
    table = identify(without_torque_of("shoulder", tables)).parameters
    assert list(table["name"]) == ["X2", "X3", "coulomb", "viscous"]
    assert np.allclose(table["value"], [*TRUTH[1:3], *TRUTH[5:]], rtol=0.03)


@pytest.mark.parametrize("joint", [pytest.param("shoulder", marks=pytest.mark.slow), "elbow"])
def test_nothing_is_missing_of_it_whichever_torque_was_not_recorded(tables, joint):
    found = diagnose(without_torque_of(joint, tables))
    assert found.status == "nothing_missing"
    outcome = verdict(found)
    other = {"shoulder": "elbow", "elbow": "shoulder"}[joint]
    by_joint = ("noise_floor_nm", "baseline_rmse_nm", "router", "error_budget", "units")
    assert all(set(outcome[key]) == {other} for key in (*by_joint, "depends_on"))
    assert outcome["caveats"][0].startswith(f"the torque of the {joint} was not measured")


def test_a_spring_at_the_shoulder_is_named_with_its_size(tables):
    outcome = verdict(diagnose(without_torque_of("elbow", tables, STIFFNESS)))
    (cause,) = outcome["causes"]
    assert (cause["effect"], cause["joint"]) == ("parallel_spring", "shoulder")
    assert cause["gain"]["joint"] == "shoulder"
    stiffness, rest = cause["parameters"]
    assert stiffness["value"] == pytest.approx(STIFFNESS, rel=0.03)
    assert rest["value"] == pytest.approx(REST, abs=0.02)


def test_only_causes_at_the_elbow_that_act_on_the_shoulder_are_weighed(diagnosis):
    elements = diagnosis.selected.posterior.elements
    at_elbow = {e.label for e in elements if e.joint == "elbow"}
    assert {"encoder_offset@elbow", "mass_off_axis@elbow"} <= at_elbow
    assert not {"parallel_spring@elbow", "torque_offset@elbow", "cogging@elbow"} & at_elbow
    assert not any(label.startswith("law:") for label in at_elbow)
    table = candidates(diagnosis)
    assert table["rmse_before_elbow_nm"].isna().all()
    left_out = {one[0] for one in table.loc[table["reason"].str.contains("left out"), "causes"]}
    assert "parallel_spring@elbow" in left_out


def test_the_motion_shows_a_shift_of_the_elbow_and_no_spring_there(plain):
    found = {one.effect.label: one.smallest for one in detectability_of_recorded(plain)}
    assert np.isfinite(found["encoder_offset@elbow"])
    assert not np.isfinite(found["parallel_spring@elbow"])


@pytest.mark.parametrize(
    "counts",
    [
        pytest.param(0.0, id="still"),
        pytest.param(COUNT, id="flickering encoder", marks=pytest.mark.slow),
    ],
)
def test_nothing_is_missing_of_a_knee_below_a_hip_that_rests_at_another_angle_in_each_run(counts):
    found = diagnose(braked(counts=counts))
    assert found.status == "nothing_missing"
    assert found.data.faults == ()
    assert list(found.parameters["name"]) == ["X2", "X3", "coulomb", "viscous"]


@pytest.mark.slow
def test_the_flicker_of_a_held_joint_s_encoder_is_no_rotor_inertia_of_the_other():
    """With the hip's noise in its columns, the links' inertia would fit worse than a rotor's."""
    found = diagnose(braked(cutoff_hz=12.5, counts=COUNT))
    assert (found.status, found.data.noisy_angles) == ("nothing_missing", False)


def leg_without_torque_of(joint, *effect, **values):
    """Return the runs of a leg, alone and with a wearer, without one joint's torque."""
    names = ("hip", "knee")
    joints = [{"name": n} | ({"drive": "unmeasured"} if n == joint else {}) for n in names]
    known = [float(name != joint) for name in names]
    return [
        replace(m, torque=m.torque * known, metadata=m.metadata | {"joints": joints})
        for m in session(*effect, **values)
    ]


def test_cuffs_show_the_whole_leg_of_the_wearer_without_the_hip_s_torque():
    table = diagnose(leg_without_torque_of("hip")).parameters
    bodies = table[table["effect"] == "rigid_body"]
    by_run = {run: list(rows["name"]) for run, rows in bodies.groupby("run")}
    assert by_run["exo_alone"] == by_run["with_human"] == ["X2", "X3"]
    assert by_run["human"] == ["X1", "X2", "X3", "X4"]
    whole = diagnosed().parameters
    of_wearer = whole.loc[whole["run"] == "human", "value"].to_numpy()
    own = bodies[bodies["run"] == "human"]
    assert np.all(np.abs(own["value"] - of_wearer) < 2.0 * own["std_error"])


@pytest.mark.slow
def test_a_shifted_encoder_of_the_knee_shows_in_the_hip_s_torque_alone():
    runs = leg_without_torque_of("knee", "encoder_offset", "knee", offset=0.05)
    outcome = verdict(diagnose(runs))
    (cause,) = outcome["causes"]
    assert (cause["effect"], cause["joint"]) == ("encoder_offset", "knee")
    assert cause["gain"]["joint"] == "hip"
    assert "torque of the knee was not measured" in outcome["control"]["reason"]


def test_a_measured_joint_that_rests_is_refused_with_both_ways_out():
    with_hip = [
        replace(m, metadata=m.metadata | {"joints": [{"name": "hip"}, {"name": "knee"}]})
        for m in braked(hip_torque=np.arange(4000.0))
    ]
    with pytest.raises(InputError, match=r'the hip moves for 0.0 s .* set drive = "unmeasured"'):
        diagnose(with_hip)
