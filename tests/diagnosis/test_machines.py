"""Machines that are no leg: what a servo or a ball screw hides is named, in its own units and at
its own scale."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pipelines.contracts.joints import Joint
from pipelines.contracts.verdict import EffectAtJoint
from pipelines.diagnosis.candidates.candidate import proposals
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.selection.answer import answer_of
from pipelines.diagnosis.verdict.candidate_table import candidates
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.dynamics.assembly import assemble
from pipelines.effects.backlash import Backlash
from pipelines.effects.parallel_spring import ParallelSpring
from pipelines.errors import InputError
from pipelines.identification import identify
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.machine import THE_LEG, Machine, machine_of
from pipelines.mechanics.mechanisms.leg import LEG
from pipelines.mechanics.motion import motion_from_table
from pipelines.mechanics.scale import on_one_scale
from pipelines.model import Model, Term, baseline
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.machines import lift, pendulum, slide
from tests.diagnosis.naming import naming


@cache
def motions(machine, **hidden):
    tables = [machine("train", 1, **hidden), machine("validate", 2, **hidden)]
    runs = [motion_from_table(motion_table(table, FilterSettings())) for table in tables]
    return [replace(m, file=f"{m.purpose}.parquet") for m in runs]


def labels(machine):
    return {
        effect.label
        for effect in proposals(Baseline(("exo_alone",), machine, cuffs=False), ("exo_alone",))
    }


@pytest.fixture(scope="module")
def screw():
    diagnosis = diagnose(motions(slide, asymmetry=-80.0))
    return diagnosis, verdict(diagnosis)


@pytest.mark.slow
def test_a_spring_at_a_small_servo_is_named_or_tied_and_fitted_to_its_size():
    diagnosis = diagnose(motions(pendulum, spring=0.8))
    outcome = verdict(diagnosis)
    (cause,) = outcome["causes"]
    assert "parallel_spring@arm" in {
        EffectAtJoint.model_validate(one).label for one in (cause, *cause["indistinguishable_from"])
    }
    assert outcome["status"] == "explained"
    (spring,) = verdict(naming(diagnosis, "parallel_spring@arm"))["causes"]
    stiffness, rest = spring["parameters"]
    assert stiffness["value"] == pytest.approx(0.8, rel=0.05)
    assert stiffness["ci95"][0] < 0.8 < stiffness["ci95"][1]
    assert (rest["value"], rest["unit"]) == (pytest.approx(0.3, abs=0.03), "rad")


def test_of_ties_the_one_that_predicts_the_validation_run_is_named():
    """A weak spring and a torque offset explain one training run about alike, and not another
    motion."""
    diagnosis = diagnose(motions(pendulum, spring=0.4))
    (trained,) = answer_of(diagnosis.selected.searched).named
    assert {"torque_offset@arm", "parallel_spring@arm"} <= trained.members
    (named,) = diagnosis.named
    assert named.element.label == "parallel_spring@arm"
    assert "torque_offset@arm" not in named.members
    assert diagnosis.selected.dropped == frozenset(), "none of them does harm"
    assert "torque_offset@arm" in diagnosis.selected.doubted


def test_too_little_to_validate_on_is_reported_with_the_fault_that_leaves_it_out():
    train, validate = motions(pendulum)
    torque = validate.torque.copy()
    torque[len(torque) // 10 :] = torque[len(torque) // 10]
    with pytest.raises(
        InputError, match=r"too few in a row to separate noise from error.*torque is stuck"
    ):
        diagnose([train, replace(validate, torque=torque)])


def test_of_what_was_weighed_in_one_variant_it_is_not_said_that_it_was_left_out(screw):
    library = screw[0].selected.library
    assert not {cause.candidate.label for cause in library.causes} & set(library.left_out)


def test_friction_that_differs_with_direction_is_named_at_a_ball_screw_in_newtons(screw):
    diagnosis, outcome = screw
    (cause,) = outcome["causes"]
    assert (cause["effect"], cause["joint"]) == ("viscous_asymmetry", "axis")
    (asymmetry,) = cause["parameters"]
    assert (asymmetry["value"], asymmetry["unit"]) == (pytest.approx(-40.0, rel=0.05), "N·s/m")
    assert outcome["units"] == {"axis": {"torque": "N", "angle": "m"}}
    assert " N, " in outcome["summary"] and "N·m" not in outcome["summary"]
    assert "m/s" in outcome["scoring"]["mask"]
    tried = candidates(diagnosis)
    assert {"rmse_before_axis_n", "rmse_after_axis_n"} <= set(tried.columns)
    taken_up = tried[tried["verdict"] == "absorbed"]["causes"].map(lambda causes: causes[0])
    assert set(taken_up) == {"rotor_inertia@axis", "torque_gain@axis"}


def test_a_cause_that_harms_the_validation_run_is_dropped_and_the_other_stays_named():
    """A spring is added to the training run alone, and both have friction that differs with
    direction."""
    train, validate = motions(slide, asymmetry=-80.0)
    diagnosis = diagnose([replace(train, torque=train.torque + 200.0 * train.q), validate])
    both = naming(diagnosis, "viscous_asymmetry@axis", "parallel_spring@axis")
    assert both.causes == ("viscous_asymmetry@axis",)
    tried = candidates(both)
    spring = tried[tried["causes"].map(lambda causes: list(causes) == ["parallel_spring@axis"])]
    assert (
        spring["reason"]
        .str.contains("the validation runs speak against parallel_spring@axis")
        .all()
    )


def test_what_is_rejected_is_listed_with_its_probability_and_its_odds_against_nothing(screw):
    diagnosis, outcome = screw
    tried = candidates(diagnosis)
    rejected = tried[(tried["verdict"] == "rejected") & tried["probability"].notna()]
    assert len(rejected) > 3
    nothing = outcome["posterior"]["nothing_missing"]
    for row in rejected.to_dict("records"):
        probability = re.search(r"its probability is (\S+?)(;|$)", row["reason"])[1]
        assert float(probability) == pytest.approx(row["probability"], rel=0.05)
        if row["probability"] > 0.0 and nothing > 0.0:
            assert row["train_score"] == pytest.approx(np.log(row["probability"]) - np.log(nothing))
    (named,) = tried[tried["verdict"] == "named"]["probability"]
    assert named > rejected["probability"].max()


@pytest.mark.slow
def test_a_springs_load_at_position_zero_is_part_of_the_force_that_holds_a_lift():
    diagnosis = diagnose(motions(lift, spring=220.0))
    (cause,) = verdict(diagnosis)["causes"]
    stiffness, rest = cause["parameters"]
    assert (cause["effect"], rest["name"]) == ("parallel_spring", "rest_angle")
    assert stiffness["ci95"][0] < 220.0 < stiffness["ci95"][1]
    assert (rest["value"], rest["ci95"]) == (0.0, [0.0, 0.0])
    (held,) = diagnosis.parameters[diagnosis.parameters["name"] == "X2"].to_dict("records")
    assert held["ci95_low"] < 12.0 * 9.81 - 220.0 * 0.02 < held["ci95_high"]
    assert any("spring balance" in sentence for sentence in cause["evidence"])
    assert not any("on its side" in sentence for sentence in cause["evidence"])


def test_a_spring_that_a_lifts_drawings_show_has_its_stiffness_fitted_and_its_rest_taken():
    diagnosis = diagnose(motions(lift, spring=220.0), known=["parallel_spring@carriage"])
    stiffness, rest = verdict(diagnosis)["known"][0]["parameters"]
    assert stiffness["ci95"][0] < 220.0 < stiffness["ci95"][1] and rest["ci95"] == [0.0, 0.0]


@pytest.mark.parametrize("machine", [lift, slide, pendulum])
def test_a_spring_with_a_given_rest_pulls_neither_way_there(machine):
    run, *_ = motions(machine)
    (joint,) = run.joints
    spring = ParallelSpring(joint, on=run.machine)
    torque = spring.torque(run, spring.values_from(np.array([50.0, 0.02])))
    np.testing.assert_allclose(torque, 50.0 * (run.q - 0.02), atol=1e-9)


def test_nobody_is_asked_for_runs_with_a_person_in_a_ball_screw(screw):
    assert screw[1]["caveats"] == []


def test_the_extended_model_simulates_the_screw_further_than_the_baseline(screw):
    outcome = screw[1]
    assert (
        outcome["extended_simulation_rmse_rad"]["axis"]
        < 0.5 * outcome["baseline_simulation_rmse_rad"]["axis"]
    )


def test_a_pendulum_and_a_screw_are_identified_without_exoid_knowing_their_size():
    arm, axis = (identify(motions(machine)).parameters for machine in (pendulum, slide))
    assert arm["name"].tolist() == ["X1", "X2", "coulomb", "viscous"]
    assert np.allclose(arm["value"], [0.03, 0.125, 0.04, 0.05], rtol=0.05)
    assert axis["unit"].tolist() == ["kg", "N", "N·s/m"]
    assert np.allclose(axis["value"], [90.0, 20.0, 200.0], rtol=0.05)


def test_a_pendulum_whose_zero_is_half_a_turn_off_is_reported_upside_down():
    hanging = motions(pendulum)
    turned = [replace(m, q=m.q + np.pi) for m in hanging]
    (remark,) = identify(turned).remarks
    assert remark.startswith("exo_alone: X2 = -0.125 kg·m")
    assert "the zero is half a turn off" in remark
    assert identify(hanging).remarks == []
    on_its_head, as_it_should = (verdict(diagnose(runs))["caveats"] for runs in (turned, hanging))
    assert any("the zero is half a turn off" in caveat for caveat in on_its_head)
    assert as_it_should == []


def test_only_what_a_machine_can_have_and_show_is_a_candidate():
    arm = machine_of([Joint("arm")], Geometry())
    turntable = machine_of([Joint("table")], Geometry(gravity_m_s2=0.0))
    lift = machine_of([Joint("lift", "prismatic")], Geometry())
    assert {"base_tilt", "mass_off_axis@arm", "encoder_offset@arm", "backlash@arm"} <= labels(arm)
    assert not {"torque_gain@arm", "rotor_inertia@arm"} & labels(arm)
    gone = {
        "base_tilt",
        "mass_off_axis@table",
        "payload_change@table",
        "encoder_offset@table",
        "backlash@table",
    }
    assert not gone & labels(turntable)
    assert not {"torque_offset@lift", "coulomb_asymmetry@lift"} & labels(lift)
    assert "payload_change@lift" in labels(lift)
    crane = Machine(
        replace(LEG, kinds=("prismatic", "revolute")), (Joint("trolley", "prismatic"), Joint("rod"))
    )
    assert "base_tilt" not in labels(crane)
    elbow = machine_of([Joint("shoulder"), Joint("elbow")], Geometry(0.3))
    renamed = {label.replace("shoulder", "hip").replace("elbow", "knee") for label in labels(elbow)}
    assert renamed == labels(THE_LEG)


def test_ranges_go_with_the_machine_and_a_leg_keeps_its_own():
    (arm, _), (axis, _) = (on_one_scale(motions(machine)) for machine in (pendulum, slide))
    by_label = {
        e.label: e
        for e in proposals(Baseline(("exo_alone",), axis.machine, cuffs=False), ("exo_alone",))
    }
    low, high = by_label["parallel_spring@axis"].linear[0].typical
    assert by_label["parallel_spring@axis"].linear[0].unit == "N/m"
    assert low > 20.0 and high / low == pytest.approx(20.0)
    assert arm.machine.scale("arm").torque < 0.1 and arm.machine.scale("arm").travel == 1.0
    assert (
        on_one_scale([replace(arm, metadata={}, joints=("hip", "knee"), scales=())])[0].scales == ()
    )


def test_a_faster_machine_needs_less_of_a_run_and_a_slower_one_no_more():
    arm, axis = (on_one_scale(motions(machine))[0].machine for machine in (pendulum, slide))
    assert arm.lasting(5.0) == pytest.approx(5.0 / arm.scale("arm").speed)
    assert axis.lasting(5.0) <= 5.0 and THE_LEG.lasting(5.0) == 5.0


def test_play_of_another_machine_is_not_simulated_with_an_exoskeletons_teeth():
    machine = machine_of([Joint("arm")], Geometry())
    terms = [
        Term(effect, np.ones(len(effect.linear))) for effect in baseline(machine, ("exo_alone",))
    ]
    play = Term(Backlash("arm", on=machine), np.array([0.01]))
    with pytest.raises(
        InputError,
        match=r"backlash@arm: backlash can only be simulated for an exoskeleton's joints",
    ):
        assemble(Model((*terms, play)), Geometry(), ["arm"])


@pytest.mark.parametrize("form", [0, 1])
def test_teeth_are_hard_or_soft_by_the_measure_of_their_own_joint(form):
    """The link hangs on hard teeth at the motor's speed; soft ones it strikes, and has a speed of
    its own."""
    (motion, _) = on_one_scale(motions(pendulum))
    (joint,), body = motion.joints, np.ones(len(motion.machine.mechanism.parameters))
    play = Backlash(joint, on=motion.machine)
    loaded = motion.loaded(body, body)
    link = play.corrected(loaded, (play.shape[0].typical[1], play.shape[1].forms[form]))
    assert np.array_equal(link.dq, loaded.dq) == (form == 0)
