"""A new experiment from `exoid init` to the simulated leg, over Modbus TCP, on a rig that hides
nothing."""

import json
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

from exoid_cli.app import run
from pipelines.contracts import MOTION, PARAMETERS
from pipelines.settings.rig import load_rig

pytestmark = pytest.mark.long

CHANGES = {
    # Not seconds: a busy machine would find another motion.
    "iterations = 800 ": "iterations = 50 ",
    "base_frequency_hz = 0.1 ": "base_frequency_hz = 0.2 ",
    "harmonics = 5 ": "harmonics = 3 ",
    'rig = "rigs/default.toml"': 'rig = "rigs/plain.toml"',
    "duration_s = 40.0\n": "duration_s = 10.0\n",
    "\nsample_rate_hz = 200.0\n": "\nsample_rate_hz = 100.0\n",
    "figures = true": "figures = false",
    "150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0, 500.0]": "150.0]",
}
OTHER_GAIN = ("feedback_gain_nm_s_rad = 300.0", "feedback_gain_nm_s_rad = 200.0")
RUNS = [
    f"{kind}_{purpose}" for kind in ("exo_alone", "with_human") for purpose in ("train", "validate")
]
AT_99_9 = 3.29 / 1.96
"""From the half-width of a 95 % interval to that of a 99.9 % one."""


@pytest.fixture(scope="module")
def created(tmp_path_factory):
    """An experiment that `exoid run` has made, and the stages that ran."""
    folder = tmp_path_factory.mktemp("whole") / "experiment"
    assert run(["init", str(folder), "--quiet"]) == 0
    for old, new in CHANGES.items():
        change(folder / "exoid.toml", old, new)
    change(folder / "rigs" / "plain.toml", "ramp_s = 3.0", "ramp_s = 1.0")
    # A process of its own, as a user's, in which all 18 commands share one start.
    command = [sys.executable, "-m", "exoid_cli.app", "run", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder, [step["command"][1] for step in json.loads(done.stdout)]


@pytest.fixture
def experiment(created, tmp_path, monkeypatch):
    """The current folder: a copy of it, with the times of its files."""
    folder = shutil.copytree(created[0], tmp_path / "experiment")
    monkeypatch.chdir(folder)
    return folder


def change(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def make(folder):
    """Run make as a user would; returns what it said and the stages that ran."""
    command = ["make", "-C", folder, f"EXOID={sys.executable} -m exoid_cli.app"]
    done = subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, "MAKEFLAGS": ""}
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, re.findall(r"^\S+ -m exoid_cli\.app (\w+)", done.stdout, flags=re.MULTILINE)


def written(folder):
    """When each of the experiment's files was written."""
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


def test_a_new_experiment_finds_the_truth_of_a_rig_that_hides_nothing(created, experiment):
    assert sorted(created[1]) == sorted(
        ["design", *["acquire", "filter"] * 4, "identify", "diagnose", *["simulate"] * 6, "report"]
    )
    actual = PARAMETERS.read(experiment / "identified" / "parameters.parquet").frame
    middle, half = actual["value"], AT_99_9 * (actual["ci95_high"] - actual["ci95_low"]) / 2
    apart = np.abs(middle - truth(experiment)) / half
    assert (apart < 1.0).all(), actual.assign(truth=truth(experiment), apart=apart).to_string()
    # An interval that covers everything would not be an answer.
    body = actual["effect"] == "rigid_body"
    assert (half[body] < 0.15 * middle[body] + 0.02).all()


@pytest.mark.slow
def test_make_does_nothing_twice_and_after_a_change_only_what_depends_on_it(experiment):
    before = written(experiment)
    output, stages = make(experiment)
    assert (stages, written(experiment)) == ([], before)
    assert "Nothing to be done" in output
    change(experiment / "exoid.toml", *OTHER_GAIN)
    _, stages = make(experiment)
    changed = {path for path, when in written(experiment).items() if before.get(path) != when}
    names = {path.name for path in changed if ".settings" not in path.parts}
    assert stages == ["simulate", "simulate", "report"]
    assert names == {"exoid.toml", "rbf.parquet", "kv-sweep.csv", "report.html"}


def test_make_and_exoid_agree_on_what_is_done(exoid, experiment):
    before = written(experiment)
    assert {one["state"] for one in json.loads(exoid("status", "--json").out)} == {"done"}
    assert exoid("run").out == "Everything is up to date.\n"
    assert written(experiment) == before
    change(experiment / "exoid.toml", *OTHER_GAIN)
    output = exoid("status").out
    assert "simulate.feedback_gain_nm_s_radwas300.0,is200.0" in "".join(output.split())
    assert "3 of 18 steps are to do" in output
    assert max(map(len, output.splitlines())) <= 80
    done = json.loads(exoid("run", "--json").out)
    assert [one["stage"] for one in done] == ["simulate", "extended", "report"]
    assert set(done[0]["result"]["peak_torque_nm"]) == {"hip", "knee"}
    assert make(experiment)[1] == []


def test_a_file_that_a_stage_lacks_is_named_and_made_again(exoid, experiment):
    lost = [
        "identified/residuals.parquet",
        "simulated/kv-sweep.csv",
        "simulated/replay-exo_alone_validate-closed-loop.parquet",
    ]
    for name in lost:
        (experiment / name).unlink()
    message = {reason for one in json.loads(exoid("status", "--json").out) for reason in one["why"]}
    assert message == {
        "waits for identify",
        "waits for simulate",
        "waits for replay",
        *(f"{x} is missing" for x in lost),
    }
    again = [one["stage"] for one in json.loads(exoid("run", "--json").out)]
    assert again == ["identify", "simulate", "replay", "report"]
    assert all((experiment / name).is_file() for name in lost)
    assert {one["state"] for one in json.loads(exoid("status", "--json").out)} == {"done"}


@pytest.mark.slow
def test_make_makes_a_file_again_that_is_lost(experiment):
    (experiment / "simulated" / "kv-sweep.csv").unlink()
    assert make(experiment)[1] == ["simulate", "report"]
    assert make(experiment)[1] == []


def test_what_is_made_anew_and_says_the_same_makes_nothing_stale(exoid, experiment):
    # Not a fit: how a sum is dealt out to a busy machine's cores may change its last bit.
    assert exoid("filter", "--again").code == 0
    assert {one["state"] for one in json.loads(exoid("status", "--json").out)} == {"done"}


def test_a_command_alone_leaves_what_is_up_to_date(exoid, experiment):
    for command, *results in (
        ("design", "trajectory.parquet"),
        ("acquire", *(f"recordings/{name}.parquet" for name in RUNS)),
        ("diagnose", "diagnosed/verdict.json"),
    ):
        assert exoid(command).out.splitlines() == [
            f"{result}: up to date; --again makes it again" for result in results
        ]


def test_a_command_alone_does_its_stage_and_warns_of_what_it_builds_on(exoid, experiment):
    change(experiment / "exoid.toml", "order = 4\n", "order = 2\n")
    outcome = exoid("identify")
    assert outcome.code == 0
    assert (
        outcome.err
        == "warning: filter is stale: filter.order was 4, is 2; `exoid run identify` brings it up"
        " to date too\n"
    )
    outcome = exoid("filter")
    assert outcome.code == 0
    assert [line for line in outcome.out.splitlines() if line.startswith("exoid ")] == [
        f"exoid filter recordings/{name}.parquet --config exoid.toml -o motions/{name}.parquet"
        for name in RUNS
    ]
    assert all(
        MOTION.read(f"motions/{name}.parquet").metadata["config"]["filter"]["order"] == 2
        for name in RUNS
    )
    done = json.loads(exoid("run", "simulate", "--json").out)
    assert [one["stage"] for one in done] == ["identify", "simulate"]
    stale = {
        one["stage"] for one in json.loads(exoid("status", "--json").out) if one["state"] == "stale"
    }
    assert stale == {"diagnose", "replay", "extended", "report"}


def test_a_command_alone_says_which_command_makes_what_is_missing(exoid, experiment):
    (experiment / "motions" / "exo_alone_train.parquet").unlink()
    outcome = exoid("identify")
    assert outcome.code == 2
    assert (
        outcome.err
        == "exoid: motions/exo_alone_train.parquet: no such file yet; `exoid filter` makes it,"
        " `exoid run identify` makes all that is needed\n"
    )


def test_what_is_not_given_comes_from_the_experiment(exoid, experiment):
    change(experiment / "exoid.toml", "order = 4\n", "order = 3\n")
    assert exoid("filter", "recordings/with_human_train.parquet", "--cutoff-hz", "7").code == 0
    config = MOTION.read("motions/with_human_train.parquet").metadata["config"]
    assert config["filter"] == {"cutoff_hz": 7.0, "order": 3, "block_s": 0.025}
    assert exoid("identify", "-o", "elsewhere").code == 0
    assert len(PARAMETERS.read("elsewhere/parameters.parquet").metadata["inputs"]) == 4
    assert exoid("simulate", "--replay", "recordings/with_human_train.parquet").code == 0
    assert (experiment / "simulated" / "replay-with_human_train.parquet").is_file()


def test_a_model_is_shown_by_its_parameters(exoid, experiment):
    outcome = exoid("show", "identified/parameters.parquet")
    assert (outcome.code, outcome.err) == (0, "")
    lines = outcome.out.splitlines()
    assert any(
        line.startswith("X1 human ") and line.endswith("kg·m²      inertia") for line in lines
    )
    assert max(map(len, lines)) <= 80


def test_the_candidates_of_a_diagnosis_are_shown_with_what_became_of_each(exoid, experiment):
    lines = exoid("show", "diagnosed/candidates.parquet").out.splitlines()
    first_reason = next(n for n, line in enumerate(lines) if line.startswith("  "))
    entry = " ".join(lines[2:first_reason])  # its words may take two lines
    assert re.fullmatch(
        r"1 \S.* at the (hip|knee).*: (named|unlisted|rejected|absorbed|indistinguishable)", entry
    )
    assert not any("@" in line for line in lines)
    assert max(map(len, lines)) <= 80


def truth(experiment):
    """What the rig file says, in the order of the rows of ``parameters/1``."""
    plant = load_rig(experiment / "rigs" / "plain.toml").plant
    exo, human = np.array(plant.exo_inertial), np.array(plant.human_inertial)
    friction = np.column_stack([plant.coulomb_nm, plant.viscous_nm_s_rad]).ravel()
    return np.concatenate([exo, friction, exo + human, human])
