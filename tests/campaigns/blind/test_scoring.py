"""Right is right, an honest tie too, and nothing else."""

import math
import sys

import pytest

from tests.campaigns.blind.detection import smallest_visible
from tests.campaigns.blind.examine import diagnose
from tests.campaigns.blind.report import pages
from tests.campaigns.blind.scoring import score

SECRET = {"hip": 0.5, "knee": 0.4}


def truth_of(category, *hidden, fault=None, kin=()):
    effects = [
        {
            "effect": effect,
            "joint": joint,
            "form": "some",
            "own_form": False,
            "parameters": {"play": 0.03},
            "magnitude": 0.1,
            "rms_nm": 1.0,
            "kin": list(kin),
        }
        for effect, joint in hidden
    ]
    case = {"seed": 1, "category": category, "kinds": ["exo_alone", "with_human"], "machine": "leg"}
    return {
        "case": case,
        "hidden": effects,
        "fault": fault,
        "noise_floor_nm": SECRET,
        "left_by_baseline_nm": SECRET,
    }


def cause(effect, joint, *ties, probability=0.9, parameters=()):
    tied = [{"effect": e, "joint": j, "why": "", "how_to_separate": ""} for e, j in ties]
    return {
        "effect": effect,
        "joint": joint,
        "probability": probability,
        "parameters": list(parameters),
        "indistinguishable_from": tied,
    }


def answer_of(*causes, status="explained", faults=(), exit_code=0, message=""):
    verdict = {
        "status": status,
        "causes": list(causes),
        "data_faults": list(faults),
        "extended_rmse_nm": {"hip": 0.55, "knee": 0.4},
        "noise_floor_nm": {"hip": 0.5, "knee": 0.36},
    }
    return {
        "exit_code": exit_code,
        "message": message,
        "seconds": 2.0,
        "verdict": None if exit_code else verdict,
    }


PLAY = ("backlash", "knee")


@pytest.mark.parametrize(
    ("answer", "right"),
    [
        (answer_of(status="unknown_cause"), True),
        (answer_of(cause("quadratic_drag", "knee")), True),
        (answer_of(cause("stribeck_friction", "knee"), cause("quadratic_drag", "knee")), False),
        (answer_of(cause("quadratic_drag", "hip")), False),
        (answer_of(status="nothing_missing"), False),
    ],
)
def test_what_is_outside_the_catalogue_is_unknown_or_called_what_a_person_would_call_it(
    answer, right
):
    truth = truth_of("outside", ("outside:dead_zone_damper", "knee"), kin=("quadratic_drag",))
    assert score(truth, answer).right is right


@pytest.mark.parametrize(
    ("answer", "right"),
    [
        (answer_of(cause(*PLAY)), True),
        (answer_of(cause("joint_elasticity", "knee", PLAY)), True),
        (answer_of(cause("joint_elasticity", "knee"), cause(*PLAY)), False),
        (answer_of(cause("backlash", "hip")), False),
        (answer_of(status="unknown_cause"), False),
        (answer_of(status="nothing_missing"), False),
        (answer_of(exit_code=2, message="run_1.parquet: no"), False),
    ],
)
def test_a_single_effect_is_right_when_named_or_tied_first(answer, right):
    assert score(truth_of("single", PLAY), answer).right is right


def test_a_cause_of_the_whole_leg_has_no_joint():
    truth = truth_of("single", ("base_tilt", None))
    assert score(truth, answer_of(cause("base_tilt", None))).right
    assert not score(truth, answer_of(cause("base_tilt", "hip"))).right


def test_silence_is_right_only_below_what_can_be_seen():
    silent = answer_of(status="nothing_missing")
    truth = truth_of("single", PLAY)
    assert score(truth, silent, {PLAY: 1.5}).unseen
    assert score(truth, silent, {PLAY: 1.5}).right
    assert not score(truth, silent, {PLAY: 0.5}).right
    assert not score(truth, answer_of(cause("cogging", "hip")), {PLAY: 1.5}).right


def test_of_a_pair_both_have_to_be_named():
    truth = truth_of("pair", PLAY, ("cogging", "hip"))
    assert score(truth, answer_of(cause("cogging", "hip"), cause(*PLAY))).right
    assert score(
        truth, answer_of(cause("cogging", "hip"), cause("joint_elasticity", "knee", PLAY))
    ).right
    assert not score(truth, answer_of(cause("cogging", "hip"))).right


def test_what_is_too_small_of_a_pair_is_counted_apart_and_not_right():
    truth, named = truth_of("pair", PLAY, ("cogging", "hip")), answer_of(cause("cogging", "hip"))
    missed = score(truth, named, {PLAY: 1.5})
    assert missed.unseen and not missed.right
    assert not score(truth, named, {PLAY: 0.5}).unseen
    assert not score(truth, answer_of(status="nothing_missing"), {PLAY: 1.5}).unseen


@pytest.mark.parametrize("category", ["none", "imperfect"])
def test_anything_but_silence_is_a_false_alarm(category):
    truth = truth_of(category)
    assert score(truth, answer_of(status="nothing_missing")).right
    assert not score(truth, answer_of(status="unknown_cause")).right
    assert not score(truth, answer_of(cause(*PLAY))).right
    fault = {"file": "run_1.parquet", "channel": "time_s", "what": "a gap"}
    assert not score(truth, answer_of(status="nothing_missing", faults=[fault])).right


def test_outside_the_catalogue_only_unknown_is_right():
    truth = truth_of("outside", ("outside:tone", "knee"))
    assert score(truth, answer_of(status="unknown_cause")).right
    assert not score(truth, answer_of(cause("voluntary_torque", "knee"), status="explained")).right


@pytest.mark.parametrize(
    ("file", "channel", "what", "right"),
    [
        ("run_2.parquet", "knee_angle_rad", "stuck for 3.2 s from 12.0 s on", True),
        ("run_2.parquet", "hip_angle_rad", "stuck for 3.2 s", False),
        ("run_1.parquet", "knee_angle_rad", "stuck for 3.2 s", False),
        ("run_2.parquet", "knee_angle_rad", "a gap of 3 s", False),
    ],
)
def test_a_fault_is_named_by_file_joint_and_kind(file, channel, what, right):
    fault = {"fault": "stuck_encoder", "files": ["run_2.parquet"], "channel": "knee_angle_rad"}
    reported = {"file": file, "channel": channel, "what": what}
    assert score(truth_of("fault", fault=fault), answer_of(faults=[reported])).right is right


def test_a_refusal_that_says_the_fault_is_right():
    fault = {"fault": "degrees", "files": ["run_1.parquet"], "channel": "hip_angle_rad"}
    line = "run_1.parquet: column hip_angle_rad: 69.9 at row 3 looks like degrees"
    scored = score(truth_of("fault", fault=fault), answer_of(exit_code=2, message=line))
    assert scored.right
    assert scored.status == "refused"


def test_probabilities_intervals_and_floors_are_kept():
    inside = {"name": "play", "value": 0.031, "unit": "rad", "ci95": [0.029, 0.033]}
    named = cause(*PLAY, parameters=[inside]), cause("cogging", "hip", probability=0.4)
    scored = score(truth_of("single", PLAY), answer_of(*named))
    assert scored.probabilities == ((0.9, True), (0.4, False))
    assert scored.covered == (("backlash", "play", True),)
    assert scored.rmse_over_floor == pytest.approx({"hip": 1.1, "knee": 1.0})
    assert scored.floor_over_truth == pytest.approx({"hip": 1.0, "knee": 0.9})


def test_the_report_counts_what_was_scored():
    scores = [
        score(truth_of("single", PLAY), answer_of(cause(*PLAY))),
        score(truth_of("single", PLAY), answer_of(cause("cogging", "knee"))),
        score(truth_of("none"), answer_of(status="nothing_missing")),
    ]
    tables = {page.title: page for page in pages(scores)}
    assert tables["Summary"].rows[0][1].startswith("50.0 % of 2")
    confusion = tables["Confusion: hidden against named first"]
    assert confusion.rows == [("1 backlash", "1", "1", ""), ("2 cogging", "", "", "")]
    assert tables["Wrong answers"].rows[0][-1] == "cogging@knee"


FAKE = """
import json, os, pathlib, sys
out = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
seen = {"argv": sys.argv[1:], "there": sorted(os.listdir())}
(out / "verdict.json").write_text(json.dumps(seen))
print("a warning", file=sys.stderr)
"""


def test_the_diagnosis_gets_the_recordings_and_nothing_else(tmp_path):
    (tmp_path / "sessions" / "s").mkdir(parents=True)
    (tmp_path / "answers").mkdir()
    for name in ("run_2.parquet", "run_1.parquet"):
        (tmp_path / "sessions" / "s" / name).touch()
    answer = diagnose(
        tmp_path / "sessions" / "s", tmp_path / "answers", (sys.executable, "-c", FAKE)
    )
    files = ["run_1.parquet", "run_2.parquet"]
    assert answer["verdict"] == {
        "argv": ["diagnose", *files, "--out", str(tmp_path / "answers"), "--no-figures"],
        "there": files,
    }
    assert answer["message"] == "a warning"
    assert answer["exit_code"] == 0


def test_a_diagnosis_that_fails_has_no_verdict(tmp_path):
    answer = diagnose(tmp_path, tmp_path, (sys.executable, "-c", "raise SystemExit(2)"))
    assert (answer["exit_code"], answer["verdict"]) == (2, None)


def test_what_can_be_seen_is_read_where_it_is_said(tmp_path):
    assert smallest_visible(tmp_path) is None
    (tmp_path / "detectability.json").write_text(
        '{"causes": [{"effect": "base_tilt", "joint": null, "smallest_rms_nm": 0.4}]}'
    )
    assert smallest_visible(tmp_path) == {("base_tilt", None): 0.4}


def finding(family, joint, probability=0.8):
    return {"level": "family", "family": family, "joint": joint, "probability": probability}


@pytest.mark.parametrize(
    ("findings", "right"),
    [
        ([finding("angle", "knee")], True),
        ([finding("time", "hip"), finding("reversal", "knee")], True),
        ([finding("angle", None)], True),
        ([finding("angle", "hip")], False),
        ([finding("speed", "knee")], False),
        ([finding("angle", "knee", probability=0.4)], False),
        ([], False),
    ],
)
def test_a_family_is_right_at_its_joint_where_it_is_likely(findings, right):
    truth = truth_of("outside", ("outside:friction_by_other_joint", "knee"))
    truth["hidden"][0]["families"] = ["angle", "reversal"]
    answer = answer_of(status="unknown_cause")
    answer["verdict"]["findings"] = findings
    assert score(truth, answer).family_right is right


def test_a_verdict_without_findings_has_no_family():
    truth = truth_of("outside", ("outside:tone", "knee"))
    truth["hidden"][0]["families"] = ["time"]
    assert score(truth, answer_of(status="unknown_cause")).family_right is None


def test_an_unlikely_cause_with_an_unknown_one_is_no_wrong_name():
    truth = truth_of("outside", ("outside:tone", "knee"))
    named = [cause("cogging", "knee", probability=p) for p in (0.3, 0.7)]
    assert score(truth, answer_of(named[0], status="partly_explained")).right
    assert not score(truth, answer_of(named[1], status="partly_explained")).right


@pytest.mark.parametrize(
    ("category", "hidden", "probability"),
    [
        ("none", (), 0.2),
        ("single", (PLAY,), 0.7),
        ("single", (("base_tilt", None),), 0.05),
        ("single", (("cogging", "hip"),), 1e-4),
        ("outside", (("outside:tone", "hip"),), 0.3),
        ("pair", (PLAY, ("base_tilt", None)), (0.7 * 0.05) ** 0.5),
    ],
)
def test_the_truths_probability_is_read_off_the_posterior(category, hidden, probability):
    answer = answer_of(cause(*PLAY))
    causes = {"backlash@knee": 0.7, "base_tilt": 0.05}
    answer["verdict"]["posterior"] = {"nothing_missing": 0.2, "unlisted": 0.3, "causes": causes}
    log_probability = score(truth_of(category, *hidden), answer).log_probability
    assert log_probability == pytest.approx(math.log(probability))


def test_a_gap_that_the_file_declares_is_no_false_alarm():
    truth = truth_of("none") | {"with_gaps": ["run_1.parquet"]}
    gap = {"file": "run_1.parquet", "channel": "time_s", "what": "2 gaps in the recording"}
    other = gap | {"file": "run_2.parquet"}
    assert score(truth, answer_of(status="nothing_missing", faults=[gap])).right
    assert not score(truth, answer_of(status="nothing_missing", faults=[other])).right


def test_the_report_shows_each_world():
    planar = truth_of("single", PLAY)
    planar["case"] |= {"world": "planar"}
    scores = [
        score(truth_of("single", PLAY), answer_of(cause(*PLAY))),
        score(planar, answer_of(cause("cogging", "knee"))),
    ]
    tables = {page.title: page for page in pages(scores)}
    assert tables["By world"].head == ("", "mujoco", "planar")
    assert [cell[:5] for cell in tables["By world"].rows[0][1:]] == ["100.0", "0.0 %"]
