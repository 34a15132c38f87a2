"""A leg with a person in it is moved only after a person has said yes."""

import io
import os
import re
import subprocess
import sys

import pandas as pd
import pytest

from pipelines.contracts import RECORDING
from pipelines.settings import datasets
from pipelines.settings.rig import RigSettings


@pytest.fixture
def experiment(tmp_path):
    """Write an experiment with one run on a rig that is not there; returns the arguments that
    record it."""

    def write(run="with_human", embedded="false"):
        text = (datasets() / "rigs" / "real_time.toml").read_text()
        text = text.replace("embedded = true", f"embedded = {embedded}").replace(
            'map = "servo"', 'map = "servo"\nport = 1'
        )
        (tmp_path / "rig.toml").write_text(text)
        config = tmp_path / "exoid.toml"
        config.write_text(
            f'[acquire]\nrig = "rig.toml"\n[[run]]\nname = "one"\nrun = "{run}"\npurpose ='
            ' "train"\nduration_s = 10.0\n'
        )
        trajectory = datasets() / "paper" / "trajectory.toml"
        return [
            "acquire",
            "--config",
            config,
            "--run",
            "one",
            "--trajectory",
            trajectory,
            "-o",
            tmp_path / "one.parquet",
        ]

    return write


@pytest.fixture
def answer(monkeypatch):
    """Let a person at the terminal answer."""

    def sit(text):
        monkeypatch.setattr("sys.stdin", io.StringIO(text))
        monkeypatch.setattr("exoid_cli.confirm._at_a_terminal", lambda: True)
        monkeypatch.setattr("exoid_cli.confirm._discard_typed_input", lambda: None)

    return sit


@pytest.fixture
def typed_ahead(experiment):
    """Start the experiment's run in a process of its own, with a yes typed before it asks; returns
    it and its end."""
    pty = pytest.importorskip("pty")

    def start(err=None):
        here, there = pty.openpty()
        os.write(here, b"y\n")
        command = [sys.executable, "-m", "exoid_cli.app", *map(str, experiment())]
        process = subprocess.Popen(
            command, stdin=there, stdout=subprocess.DEVNULL, stderr=err or there
        )
        os.close(there)
        return process, here

    return start


def read_until(terminal, words=None):
    """Return what a terminal shows, up to some words or its end."""
    seen = b""
    while words is None or words not in seen:
        try:
            part = os.read(terminal, 65536)
        except OSError:  # the end, as Linux has it
            part = b""
        if not part:
            break
        seen += part
    return seen.decode()


def test_a_yes_that_was_typed_before_the_question_is_no_answer_to_it(typed_ahead):
    process, terminal = typed_ahead()
    assert "limits -2.1 to +0.35 rad" in read_until(terminal, b"[y/N]")
    os.write(terminal, b"n\n")
    assert "run one was not confirmed; nothing was moved" in read_until(terminal)
    assert process.wait() == 2


def test_a_question_that_nobody_sees_is_not_asked(typed_ahead, tmp_path):
    with open(tmp_path / "err", "w") as err:
        process, _ = typed_ahead(err)
        assert process.wait() == 2
    assert "confirm it on a terminal, or give --yes" in (tmp_path / "err").read_text()


WENT_ON = "drive hip (127.0.0.1:1, unit 1): refuses the connection"


def test_without_a_terminal_a_run_with_a_person_is_refused_in_one_line(
    exoid, experiment, monkeypatch
):
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    outcome = exoid(*experiment())
    assert (outcome.code, outcome.out) == (2, "")
    assert (
        outcome.err
        == "exoid: run one moves a person: confirm it on a terminal, or give --yes in a script;"
        " nothing was moved\n"
    )


@pytest.mark.parametrize("text", ["", "\n", "n\n", "yess\n"])
def test_whatever_is_no_yes_is_a_no(exoid, experiment, answer, text):
    answer(text)
    outcome = exoid(*experiment())
    assert outcome.code == 2
    assert outcome.err.endswith("exoid: run one was not confirmed; nothing was moved\n")


def test_what_will_be_moved_and_the_limits_in_force_are_shown_before_the_question(
    exoid, experiment, answer
):
    answer("yes\n")
    outcome = exoid(*experiment(), "--quiet")
    assert outcome.code == 3 and WENT_ON in outcome.err
    shown = outcome.err.partition(" [y/N] ")[0]
    for words in (
        "Run one moves a person on the rig real_time along",
        "trajectory.toml for 10 s",
        "limits -0.35 to +1.75 rad, 2.2 rad/s, 100 N·m",
        "limits -2.1 to +0.35 rad, 2.2 rad/s, 60 N·m",
        (
            "a stop takes up to 0.28 s, then the drives hold for 0.1 s before their torque is taken"
            " away"
        ),
        "stopped after",
        "of silence, or 0.1 rad from a set-point",
        "force 250 N on 4 cuff sensors",
        "Ctrl-C stops it",
        "the emergency stop at hand?",
    ):
        assert words in shown


def test_a_motion_beyond_the_limits_with_a_person_is_refused_before_the_question(
    exoid, experiment, answer, tmp_path
):
    answer("y\n")
    arguments = experiment()
    rig = tmp_path / "rig.toml"
    rig.write_text(rig.read_text().replace("speed_rad_s = 2.2", "speed_rad_s = 0.5"))
    outcome = exoid(*arguments)
    assert outcome.code == 2
    assert "but the rig allows -0.5 to 0.5 rad/s" in outcome.err
    assert "[y/N]" not in outcome.err


@pytest.mark.parametrize(("run", "more"), [("with_human", ["--yes"]), ("exo_alone", [])])
def test_scripts_and_runs_with_nobody_are_not_asked(exoid, experiment, run, more):
    outcome = exoid(*experiment(run), *more)
    assert outcome.code == 3
    assert outcome.err.startswith(f"exoid: {WENT_ON}")


def test_with_yes_given_beforehand_a_warning_says_that_nobody_watches_the_cuffs(
    exoid, experiment, tmp_path
):
    arguments = experiment()
    text = (tmp_path / "rig.toml").read_text()
    without = re.sub(r"\[\[sensor\]\][^\[]*", "", text)
    (tmp_path / "rig.toml").write_text(without)
    outcome = exoid(*arguments, "--yes")
    assert outcome.err.startswith(
        "warning: the rig file has no [[sensor]]: the force on the cuffs is not watched; add the"
        " sensors\n"
    )


def test_nobody_is_strapped_into_an_embedded_rig(exoid, experiment, monkeypatch):
    recorded = []
    monkeypatch.setattr(
        "pipelines.acquisition.acquire.acquire", lambda *a, **k: recorded.append(a) or 1 / 0
    )
    outcome = exoid(*experiment(embedded="true"))
    assert len(recorded) == 1
    assert "[y/N]" not in outcome.err


@pytest.mark.parametrize("option", ["--move", "--by-hand"])
def test_a_leg_of_unverified_signs_is_not_checked_in_motion_with_a_person_in_it(exoid, option):
    outcome = exoid(
        "rig", "check", datasets() / "rigs" / "plain.toml", "--run", "with_human", option, "--yes"
    )
    assert (outcome.code, outcome.out) == (2, "")
    assert (
        outcome.err
        == f"exoid: {option} needs an empty machine, but --run with_human means a person; drop"
        " one\n"
    )


def test_what_was_shown_is_what_runs_though_the_file_is_changed_meanwhile(
    exoid, experiment, answer, monkeypatch
):
    loads, load = [], RigSettings.in_force
    monkeypatch.setattr(
        RigSettings, "in_force", lambda rig, run: (loads.append(run), load(rig, run))[1]
    )
    answer("y\n")
    assert WENT_ON in exoid(*experiment()).err
    assert loads == ["with_human"]


@pytest.fixture
def with_excitation(experiment, tmp_path, monkeypatch):
    """Make an experiment whose run has its excitation, and go to its folder."""

    def make(**settings):
        experiment(**settings)
        config = tmp_path / "exoid.toml"
        excitation = datasets() / "paper" / "trajectory.toml"
        config.write_text(config.read_text() + f'trajectory = "{excitation.as_posix()}"\n')
        monkeypatch.chdir(tmp_path)

    return make


@pytest.mark.parametrize("words", [("acquire",), ("run", "acquire")])
def test_a_run_that_nobody_named_is_asked_about_before_it_moves_even_an_empty_machine(
    exoid, with_excitation, monkeypatch, words
):
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    with_excitation(run="exo_alone")
    outcome = exoid(*words)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "run one moves the empty machine: confirm it on a terminal" in outcome.err


def test_a_no_to_it_moves_nothing_and_a_yes_goes_on_to_the_drives(exoid, with_excitation, answer):
    with_excitation(run="exo_alone")
    answer("no\n")
    refused = exoid("acquire")
    assert refused.code == 2
    assert "run one was not confirmed; nothing was moved" in refused.err
    assert re.search(r"\n  knee  \S+ to \S+ rad at up to \S+ rad/s; limits", refused.err)
    answer("yes\n")
    assert exoid("acquire").code == 3  # there is no rig to be found
    assert exoid("acquire", "--yes").code == 3


@pytest.fixture
def recorded(tmp_path):
    """Leave a recording where the run's is to be; returns its path."""

    def leave(embedded):
        path = tmp_path / "one.parquet"
        rig = {"name": "leg", "embedded": embedded}
        metadata = {
            "run": "exo_alone",
            "purpose": "train",
            "sample_rate_hz": 200.0,
            "config": {"rig": rig},
        }
        frame = pd.DataFrame(
            {name: [0.0, 0.005] for name in ("time_s", "hip_angle_rad", "hip_torque_nm")}
        )
        RECORDING.write(path, frame, metadata | {"joints": [{"name": "hip", "kind": "revolute"}]})
        return path

    return leave


def test_a_recording_of_a_real_rig_is_replaced_only_where_that_is_said(exoid, experiment, recorded):
    path, arguments = recorded(embedded=False), experiment("exo_alone")
    before = path.read_bytes()
    refused = exoid(*arguments, "--yes")
    assert (refused.code, refused.err) == (
        2,
        (
            f"exoid: {path}: is a recording of the rig leg, not overwritten; --overwrite replaces"
            " it, -o writes another file\n"
        ),
    )
    assert WENT_ON in exoid(*arguments, "--overwrite").err
    assert path.read_bytes() == before


def test_a_recording_of_a_virtual_leg_is_made_again(exoid, experiment, recorded):
    recorded(embedded=True)
    assert WENT_ON in exoid(*experiment("exo_alone")).err


@pytest.mark.parametrize(("more", "code"), [((), 2), (("--overwrite",), 3)])
def test_a_stale_recording_of_a_real_rig_is_not_lost_to_a_run_that_nobody_named(
    exoid, with_excitation, recorded, tmp_path, more, code
):
    with_excitation(run="exo_alone")
    (tmp_path / "recordings").mkdir()
    recorded(embedded=False).rename(tmp_path / "recordings" / "one.parquet")
    assert exoid("acquire", "--yes", *more).code == code


def test_a_run_is_recorded_under_no_name_but_that_of_a_parquet_file(exoid, experiment, tmp_path):
    *arguments, _ = experiment()
    outcome = exoid(*arguments, tmp_path / "one.csv", "--yes")
    assert outcome.code == 2
    assert "one.csv: expected a name that ends in .parquet" in outcome.err
