"""`exoid investigate`: what it records and when it stops, without a rig and a diagnosis."""

import json
import shutil

import pytest

from exoid_cli import investigate
from pipelines.investigation.separation import Separation
from pipelines.settings.template import create
from tests.report.sessions import decision_of, write_recording, write_verdict

SEARCH = "[design]\nharmonics = 2\nparticles = 8\niterations = 5\nseconds = 2.0\n"
COGGING = [
    ("amplitude", 1.5, "N·m"),
    ("cycles_per_turn", 9.0, "1/turn"),
    ("phase", 0.4, "rad"),
]
EASY = {"ties": ("rotor_inertia",)}
"""A motion tells cogging and rotor inertia apart."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    create(tmp_path, "exoid")
    (tmp_path / "exoid.toml").write_text(SEARCH + '[acquire]\nrig = "rigs/plain.toml"\n')
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_fitted(out, **decision):
    """Write a verdict that names cogging, with its values."""
    write_verdict(out, **decision_of(**decision))
    file = out / "diagnosed" / "verdict.json"
    document = json.loads(file.read_text())
    document["causes"][0]["parameters"] = [
        {"name": name, "value": value, "unit": unit, "ci95": [None, None]}
        for name, value, unit in COGGING
    ]
    file.write_text(json.dumps(document))


@pytest.fixture
def diagnosed(folder, monkeypatch):
    """Let each diagnosis have the next of some verdicts; returns the recordings of each."""
    recorded = []

    def prepare(*decisions):
        coming = iter(decisions)

        def bring_up_to_date(context, experiment, wanted, before):
            recorded.append([step.run for step in wanted if step.stage == "acquire"])
            write_fitted(experiment.out, **next(coming))

        monkeypatch.setattr(investigate, "bring_up_to_date", bring_up_to_date)
        return recorded

    return prepare


def test_a_sure_verdict_needs_no_further_run(exoid, folder, diagnosed):
    recorded = diagnosed({"ties": (), "nothing": 0.01, "law": 0.0})
    done = exoid("investigate", "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert (document["state"], document["stopped_by"]) == ("named", "nothing is left open")
    assert len(recorded) == 1 and len(recorded[0]) == 4
    assert not (folder / "investigation").exists()


def test_an_open_verdict_leads_to_a_motion_and_all_runs_along_it(exoid, folder, diagnosed):
    recorded = diagnosed(EASY, {"ties": (), "nothing": 0.01, "law": 0.0})
    done = exoid("investigate", "--json")
    assert done.code == 0, done.err
    assert recorded[1][:4] == recorded[0]
    assert recorded[1][4:] == [f"{name}+1" for name in recorded[0]]
    steps = json.loads(done.out)["steps"]
    assert [one["step"] for one in steps] == [0, 1]
    assert 0.0 < steps[1]["decides"] <= 1.0
    before = json.loads((folder / "investigation" / "1" / "verdict.json").read_text())
    assert (
        steps[0]["probabilities"]["cogging@knee"] == before["posterior"]["causes"]["cogging@knee"]
    )
    assert (folder / "investigation" / "1" / "trajectory.parquet").is_file()
    # Started again, it has nothing to do.
    diagnosed({"ties": (), "nothing": 0.01, "law": 0.0})
    assert exoid("investigate").code == 0
    assert recorded[2] == recorded[1]
    assert not (folder / "investigation" / "2").exists()


def test_where_acquisition_is_at_fault_no_motion_can_help(exoid, folder, monkeypatch):
    def bring_up_to_date(context, experiment, wanted, before):
        write_verdict(experiment.out, **decision_of(**EASY))
        file = experiment.out / "diagnosed" / "verdict.json"
        at_fault = {"acquisition_at_fault": True, "findings": [], "posterior": None}
        file.write_text(json.dumps(json.loads(file.read_text()) | at_fault))

    monkeypatch.setattr(investigate, "bring_up_to_date", bring_up_to_date)
    done = exoid("investigate", "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert (document["state"], document["stopped_by"]) == ("at_fault", "no motion can help")


@pytest.mark.parametrize(
    ("budget", "why"),
    [
        ("runs = 3", "another step would make 4 further runs, investigate.runs is 3"),
        ("minutes = 1.0", "another step would make 2.67 further minutes, investigate.minutes is 1"),
        ("least_probability = 0.6", "decides with probability 0.5, and investigate.least_"),
    ],
)
def test_the_budget_ends_it(exoid, folder, diagnosed, budget, why, monkeypatch):
    # How good a motion is found within the search's seconds depends on the computer.
    monkeypatch.setattr(Separation, "decides", lambda self: 0.5)
    diagnosed(EASY)
    with (folder / "exoid.toml").open("a") as file:
        file.write(f"[investigate]\n{budget}\n")
    done = exoid("investigate", "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert document["state"] == "open"
    assert why in document["stopped_by"]
    assert not (folder / "investigation" / "1").exists()


def test_a_second_one_at_the_same_time_does_not_replace_the_first_one_s_motion(
    exoid, folder, diagnosed, monkeypatch
):
    diagnosed(EASY)
    compare, motion = investigate.compare_experiments, folder / "investigation/1/trajectory.parquet"

    def and_the_other_one_is_faster(*arguments):
        result = compare(*arguments)
        motion.parent.mkdir(parents=True)
        motion.write_text("the other one's")
        return result

    monkeypatch.setattr(investigate, "compare_experiments", and_the_other_one_is_faster)
    done = exoid("investigate")
    assert done.code == 2
    assert "written in the meantime by another `exoid investigate`" in done.err
    assert motion.read_text() == "the other one's"


def test_where_no_motion_can_decide_it_says_what_can(exoid, folder, monkeypatch):
    # At the knee Coulomb asymmetry is a torque offset, whatever moves.
    text = json.dumps(decision_of(ties=("torque_offset",))).replace("cogging", "coulomb_asymmetry")

    def bring_up_to_date(context, experiment, wanted, before):
        write_verdict(experiment.out, **json.loads(text))

    monkeypatch.setattr(investigate, "bring_up_to_date", bring_up_to_date)
    done = exoid("investigate")
    assert done.code == 0, done.err
    assert "no motion within [design.bounds] separates" in done.out
    assert "switch the drive off" in done.out


def test_a_real_rig_s_recordings_keep_the_motion_that_they_followed(exoid, folder, diagnosed):
    recorded = diagnosed(EASY)
    for name in ("exo_alone_train", "with_human_validate"):
        rig = {"name": "lab", "embedded": False}
        write_recording(
            folder, name=f"{name}.parquet", config={"rig": rig, "acquire": {"sample_rate_hz": 9.0}}
        )
    assert exoid("design").code == 0
    before = (folder / "trajectory.parquet").read_bytes()
    with (folder / "exoid.toml").open("a") as file:
        file.write("[design.noise]\nhip_nm = 0.5\n")
    done = exoid("investigate", "--yes")
    assert done.code == 2
    assert "exo_alone_train.parquet: is a recording of the rig lab" in done.err
    assert "design.noise.hip_nm was 0.6, is 0.5" in done.err
    assert not recorded
    assert (folder / "trajectory.parquet").read_bytes() == before


def test_recordings_of_other_tools_are_refused(exoid, folder):
    write_recording(folder, imported={"map": "map.toml"})
    done = exoid("investigate")
    assert done.code == 2
    assert "were imported" in done.err and "`exoid next`" in done.err


def test_a_rig_that_only_records_is_refused(exoid, folder):
    (folder / "rigs" / "plain.toml").write_text("recording_only = true\n")
    done = exoid("investigate")
    assert done.code == 2
    assert "is recording_only" in done.err


def test_a_run_of_a_step_that_has_no_motion_is_not_called_imported(exoid, folder):
    done = exoid("acquire", "--run", "exo_alone_train+9")
    assert done.code == 2
    assert "run exo_alone_train+9: there is no motion for it" in done.err
    assert "imported" not in done.err


def test_a_motion_that_was_not_recorded_yet_has_shown_nothing(exoid, folder):
    assert exoid("design").code == 0
    write_fitted(folder, **EASY)
    judge = ("design", "--from", "diagnosed", "--evaluate", "trajectory.parquet", "--json")
    before = json.loads(exoid(*judge).out)
    step = folder / "investigation" / "1"
    step.mkdir(parents=True)
    shutil.copyfile(folder / "trajectory.parquet", step / "trajectory.parquet")
    assert json.loads(exoid(*judge).out) == before
