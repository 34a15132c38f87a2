"""A level arm of two links: what gravity alone would show is asked of no motion, all else is as of
a leg."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pipelines.diagnosis.candidates.candidate import proposals
from pipelines.diagnosis.data_faults import find_faults
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.dynamics.replay import replay
from pipelines.effects import EFFECTS
from pipelines.identification import identify
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings

pytest.importorskip("mujoco")
from tests.diagnosis.planar_arm import TRUTH, planar_arm


def motions(**hidden):
    tables = [planar_arm("train", 1, **hidden), planar_arm("validate", 2, **hidden)]
    runs = [motion_from_table(motion_table(table, FilterSettings())) for table in tables]
    return [replace(m, file=f"{m.purpose}.parquet") for m in runs]


@pytest.fixture(scope="module")
def arm():
    return motions()


@pytest.fixture(scope="module")
def identified(arm):
    return identify(arm)


def test_its_three_inertial_parameters_and_its_friction_are_recovered(identified):
    table = identified.parameters
    assert list(table["name"]) == ["X1", "X2", "X3", "coulomb", "viscous", "coulomb", "viscous"]
    assert np.allclose(table["value"][:3], TRUTH[:3], rtol=0.01)
    # The drive holds each torque for 4 ms, which at reversals looks like friction of another size.
    assert np.allclose(table["value"][3:], TRUTH[3:], rtol=0.08)
    assert (identified.collinear, identified.unrealizable, identified.remarks) == ([], [], [])


def test_it_moves_as_it_was_recorded(arm, identified):
    assert replay(identified.model_of(arm[1]), arm[1]).rmse.max() < 0.01


@pytest.mark.slow
def test_nothing_is_missing_of_it(arm):
    assert diagnose(arm).status == "nothing_missing"


@pytest.mark.slow
def test_a_spring_at_its_elbow_is_named_with_its_size():
    outcome = verdict(diagnose(motions(spring=6.0)))
    (cause,) = outcome["causes"]
    assert (cause["effect"], cause["joint"]) == ("parallel_spring", "elbow")
    stiffness, rest = cause["parameters"]
    assert stiffness["value"] == pytest.approx(6.0, rel=0.03)
    assert rest["value"] == pytest.approx(0.3, abs=0.02)


def test_what_turns_gravity_is_no_candidate_and_what_turns_the_elbow_is_one(arm):
    machine = arm[0].machine
    tried = {
        effect.label
        for effect in proposals(Baseline(("exo_alone",), machine, cuffs=False), ("exo_alone",))
    }
    assert (
        not {"base_tilt", "mass_off_axis@shoulder", "encoder_offset@shoulder", "backlash@shoulder"}
        & tried
    )
    assert {
        "encoder_offset@elbow",
        "backlash@elbow",
        "mass_off_axis@elbow",
        "payload_change@elbow",
    } <= tried
    assert all(
        effect.possible(machine) for effect in EFFECTS if effect.name in ("rigid_body", "friction")
    )


@pytest.mark.parametrize(
    "times, kind, words",
    [
        (
            (1.0, 10.0),
            "unit",
            r"shoulder_torque_nm .* or elbow_torque_nm is \(kgf·cm or lbf·in\?\)",
        ),
        ((0.001, 1.0), "unit", r"shoulder_torque_nm .* \(kN·m\?\), or elbow_torque_nm is"),
        ((1.0, -1.0), "sign", "the sign of elbow_torque_nm is reversed"),
    ],
)
def test_a_torque_of_another_unit_or_sign_is_named_by_the_link_that_both_drives_carry(
    arm, times, kind, words
):
    faults = find_faults([replace(run, torque=run.torque * times) for run in arm])
    assert {(fault.kind, bool(fault.spoils)) for fault in faults} == {(kind, True)}
    assert all(re.search(words, fault.what) for fault in faults)


@pytest.mark.parametrize("times", [(1.0, 1.0), (1.6, 1.0), (1.0, 0.6)])
def test_a_gain_of_one_joint_is_no_other_unit(arm, times):
    assert find_faults([replace(run, torque=run.torque * times) for run in arm]) == []
