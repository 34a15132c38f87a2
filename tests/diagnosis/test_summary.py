"""The summary: two sentences that say what is missing, what naming it gains, and where more is left."""

from collections import defaultdict
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.contracts.joints import Joint
from pipelines.contracts.table import Table
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.fit.validation_error import scored
from pipelines.diagnosis.verdict import _evidence, _finding, _in_words, _times, _untold_length, verdict
from pipelines.effects import ParallelSpring
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.machine import machine_of
from pipelines.mechanics.motion import motion_from_table
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.sessions import recordings

SPRING = {
    "effect": "parallel_spring", "joint": "knee", "probability": 0.97, "indistinguishable_from": [],
}  # fmt: skip
STRIBECK = SPRING | {"effect": "stribeck_friction", "joint": "hip"}


@pytest.fixture(scope="module")
def stuck():
    """A spring at the knee; in one run to validate on the hip's encoder stands for five seconds."""
    motions = []
    for number, table in enumerate(recordings("parallel_spring", "knee", seed=4, stiffness=6.0, rest_angle=-0.5)):
        frame = table.frame.copy()
        if number == 1:
            frame.loc[1600:2600, "hip_angle_rad"] = frame.loc[1600, "hip_angle_rad"]
        made = motion_from_table(motion_table(Table(frame, table.metadata), FilterSettings()))
        motions.append(replace(made, file=f"run_{number}.parquet"))
    return diagnose(motions)


def with_errors(d, extended, status="partly_explained"):
    floor, baseline = np.array([0.5, 0.3]), np.array([0.6, 2.4])
    made = replace(d.standing, floor=floor, baseline=baseline, extended=np.array(extended))
    return replace(d, standing=made, status=status)


def test_a_fault_that_was_masked_is_told_beside_the_cause(stuck):
    told = verdict(stuck)
    said = told["summary"]
    assert said.startswith("Missing from the simulation: parallel spring at the knee")
    assert "Beside it, faults of acquisition: run_1.parquet, hip_angle_rad: the hip's angle is stuck" in said
    assert said.startswith(told["finding"])
    assert "acquisition" not in told["finding"]


def test_faults_that_the_summary_does_not_tell_are_counted_in_words(stuck):
    said = [verdict(replace(stuck, faults=stuck.faults[:1] * number))["summary"] for number in (1, 2, 3)]
    assert "data_faults" not in said[0]
    assert said[1].endswith("(and 1 more fault, in data_faults of verdict.json).")
    assert said[2].endswith("(and 2 more faults, in data_faults of verdict.json).")


def test_what_is_left_at_the_other_joint_is_said_to_be_there_and_how_much(stuck):
    said = _finding(with_errors(stuck, [0.56, 0.305]), [SPRING], None)
    assert said == (
        "Missing from the simulation: parallel spring at the knee (probability 0.97). With it the knee's torque error "
        "falls from 2.40 N·m, 8.00 times the noise floor, to 0.30 N·m, which is noise; "
        "the hip's is then 0.56 N·m, 1.12 times its floor."
    )


def test_the_gain_is_told_where_it_is_made_and_not_where_the_error_is_largest(stuck):
    floor, before, after = np.array([0.3, 0.3]), np.array([0.9, 0.4]), np.array([0.9, 0.305])
    made = replace(stuck.standing, floor=floor, baseline=before, extended=after)
    said = _finding(replace(stuck, standing=made, status="partly_explained"), [SPRING], None)
    assert (
        "the knee's torque error falls from 0.40 N·m, 1.33 times the noise floor, to 0.30 N·m, which is noise; " in said
    )
    assert said.endswith("the hip's is then 0.90 N·m, 3.00 times its floor.")


def test_a_floor_that_no_repetition_shows_is_said_to_be_a_guess(stuck):
    assert "guess" not in verdict(stuck)["summary"]
    short = replace(stuck, floor=replace(stuck.floor, from_periods=False))
    guess = ", so the noise floor is a guess from the band above the motion."
    assert f"No run holds two periods{guess}" in verdict(short)["summary"]
    runs = {of: tuple(without_a_period(run) for run in getattr(stuck, of)) for of in ("train", "validate")}
    told = verdict(replace(short, **runs))["summary"]
    assert f"No recording tells of a period after which its motion repeats{guess}" in told


def test_runs_too_short_to_tell_noise_are_said_to_be(stuck):
    quiet = nothing_missing(stuck, 0.05, from_periods=False)
    slow = replace(quiet.standing.slow_before, floor=np.full_like(quiet.standing.slow_before.floor, np.inf))
    told = verdict(replace(quiet, standing=replace(quiet.standing, slow_before=slow)))["finding"]
    assert told.endswith("and the runs to validate on are too short to tell whether that is noise.")


def without_a_period(run):
    return replace(run, motion=replace(run.motion, period_s=None))


def nothing_missing(d, share, from_periods):
    """A diagnosis whose noise floor is so much of each joint's torque, and of which nothing stands out."""
    floor = share * d.torque_rms
    standing = replace(d.standing, floor=floor, baseline=floor, extended=floor)
    return replace(d, standing=standing, status="nothing_missing", floor=replace(d.floor, from_periods=from_periods))


def test_a_guessed_floor_that_is_most_of_the_torque_is_said_to_hide_what_may_be_missing(stuck):
    told = verdict(nothing_missing(stuck, 0.87, from_periods=False))
    assert told["status"] == "nothing_missing"
    assert "but the floor itself is 87% of the torque: these data could show little." in told["finding"]
    assert any("the noise floor of the hip is a guess of 87% of its torque" in caveat for caveat in told["caveats"])


@pytest.mark.parametrize(("share", "from_periods"), [(0.05, False), (0.87, True)])
def test_a_floor_that_is_measured_or_a_small_share_is_taken_as_it_is(stuck, share, from_periods):
    told = verdict(nothing_missing(stuck, share, from_periods))
    assert told["finding"].startswith("Nothing is missing that these data could show")
    assert "floor itself" not in told["finding"]
    assert not any("noise floor" in caveat for caveat in told["caveats"])


def test_the_torque_that_an_error_is_of_is_told_on_the_samples_of_the_error(stuck):
    squares = [run.measured[scored(run), :2] ** 2 for run in stuck.validate]
    measured = np.sqrt(np.concatenate(squares).mean(axis=0))
    assert list(verdict(stuck)["torque_rms_nm"].values()) == pytest.approx(measured.tolist())


def test_odds_are_those_among_the_causes_that_exoid_knows_in_their_own_words(stuck):
    d = replace(stuck, likely={"parallel_spring@knee": {"parallel_spring@knee": 0.8, "torque_offset@knee": 0.02}})
    told = _evidence(d, "parallel_spring@knee", ParallelSpring("knee"), 1.0, "knee", {"parallel_spring@knee": 0.8})
    assert "of the other causes that exoid knows the next, torque offset at the knee, is 40 times less likely" in told


def test_a_gain_is_what_the_cause_takes_of_the_error_that_the_others_leave(stuck):
    label, told = "parallel_spring@knee", verdict(stuck)
    gain = told["causes"][0]["gain"]
    taken, left = gain["rmse_reduction_nm"], told["extended_rmse_nm"][gain["joint"]]
    said = f"it takes {taken:.2f} of {left + taken:.2f} N·m of torque error at the {gain['joint']}"
    assert told["causes"][0]["evidence"][0] == f"{said} on runs no fit has seen"
    two = replace(stuck, likely=stuck.likely | {"base_tilt": {"base_tilt": 0.9}}, idle=defaultdict(frozenset))
    beside = _evidence(two, label, ParallelSpring("knee"), taken, gain["joint"], {label: 0.9})[0]
    assert beside == f"{said} that the other causes leave on runs no fit has seen"


def test_two_causes_are_they_and_a_rest_at_the_worst_joint_is_not_noise(stuck):
    said = _finding(with_errors(stuck, [0.5, 1.5]), [SPRING, STRIBECK], None)
    assert "; and Stribeck friction at the hip (probability 0.97). With them the knee's" in said
    assert said.endswith("to 1.50 N·m, still 5.00 times the floor.")


def test_a_gain_that_may_be_chance_is_told_as_that_unless_the_cause_was_heard(stuck):
    label = "parallel_spring@knee"
    assert "may be chance" not in verdict(stuck)["summary"]
    idle = replace(stuck, without={label: stuck.after})
    assert "whose gain may be chance. With it" in verdict(idle)["summary"]
    told = verdict(idle)["causes"][0]["evidence"]
    assert "that gain may be chance: its 95 % interval includes nought" in told
    assert "may be chance" not in _finding(replace(idle, perceived=(label,)), verdict(idle)["causes"], None)


def test_a_gain_that_is_plainly_negative_is_not_called_chance(stuck):
    label = "parallel_spring@knee"
    better = replace(stuck.after, errors=replace(stuck.after.errors, squares=0.9 * stuck.after.errors.squares))
    told = verdict(replace(stuck, without={label: better}))
    assert told["causes"][0]["gain"]["ci95"][1] < 0.0
    assert "which gains nothing on runs no fit has seen. With it" in told["summary"]
    assert "that is no gain: its 95 % interval lies below nought" in told["causes"][0]["evidence"]
    assert told["causes"][0]["evidence"][0].startswith("it takes nothing of ")
    assert not any("chance" in said for said in (told["summary"], *told["causes"][0]["evidence"]))


def test_ties_are_one_answer_with_one_probability():
    tied = SPRING | {"indistinguishable_from": [{"effect": "base_tilt", "joint": None}]}
    assert _in_words(tied) == (
        "parallel spring at the knee or base tilt, which these data cannot tell apart (together 0.97)"
    )


@pytest.mark.parametrize(("likely", "other", "said"), [(0.8, 0.2, "4 times"), (1.0, 0.0, "over 1000 times")])
def test_odds_beyond_a_thousand_are_not_told_by_a_figure(likely, other, said):
    assert _times(likely, other) == said


@pytest.mark.parametrize(
    ("names", "length", "said"),
    [(("shoulder", "elbow"), None, True), (("shoulder", "elbow"), 0.3, False), (("hip", "knee"), None, False)],
)
def test_an_arm_whose_length_nobody_told_is_said_to_have_an_exoskeletons(names, length, said):
    geometry = Geometry() if length is None else Geometry(thigh_length_m=length)
    machine = machine_of([Joint(name) for name in names], geometry)
    run = SimpleNamespace(motion=SimpleNamespace(geometry=geometry))
    found = SimpleNamespace(baseline=SimpleNamespace(machine=machine), train=[run])
    told = _untold_length(found)
    assert bool(told) == said
    assert not said or "0.38952 m, an exoskeleton's; set geometry.thigh_length_m" in told[0]
