"""``exoid design`` on the command line: what it prints, what it writes, what it refuses."""

import json

import numpy as np
import pytest

from exoid_cli.app import run
from pipelines.contracts import TRAJECTORY
from pipelines.errors import InputError
from pipelines.settings import datasets
from tests.report.sessions import AXIS, decision_of, write_verdict

PUBLISHED = str(datasets() / "paper" / "trajectory.toml")
QUICK = "[design]\nharmonics = 2\nparticles = 16\niterations = 25\nseed = 4\nseconds = 15.0\n"


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "exoid.toml"
    path.write_text(QUICK)
    return str(path)


def test_the_published_excitation_is_judged_by_its_three_condition_numbers_and_its_margins(capsys):
    assert run(["design", "--evaluate", PUBLISHED]) == 0
    lines = capsys.readouterr().out.splitlines()
    for words in (["8", "47.3"], ["4", "22.6"], ["scaled", "5.8"], ["log det", "-3.72"]):
        assert any(all(word in line for word in words) for line in lines), words
    margins = [line.split() for line in lines if line.startswith(("hip ", "knee "))]
    assert [row[:2] for row in margins] == [
        [joint, quantity]
        for joint in ("hip", "knee")
        for quantity in ("angle", "velocity", "acceleration")
    ]
    assert [row[-1] for row in margins] == [
        "0.0000",
        "0.9869",
        "4.3410",
        "0.0001",
        "1.0338",
        "4.5751",
    ]


def test_what_lies_outside_the_bounds_is_marked(tmp_path, capsys):
    fast = tmp_path / "fast.toml"
    fast.write_text(
        'unit = "rad"\nomega_rad_s = 6.0\ntheta0_rad = [0.6, -0.9]\n'
        "a = [[0.4, 0.0], [0.1, 0.0]]\nb = [[0.0, 0.0], [0.0, 0.0]]\n"
    )
    assert run(["design", "--evaluate", str(fast)]) == 0
    captured = capsys.readouterr()
    marked = [line.split()[:2] for line in captured.out.splitlines() if line.endswith("OUT")]
    assert marked == [["hip", "velocity"], ["hip", "acceleration"]]
    assert "hip velocity goes from -2.4 to 2.4 rad/s, allowed is -1.6449 to 1.6449" in captured.err


def test_a_design_is_written_with_what_it_is_worth(tmp_path, config, capsys):
    out = tmp_path / "t.parquet"
    assert run(["design", "--config", config, "-o", str(out), "--json"]) == 0
    result, table = json.loads(capsys.readouterr().out), TRAJECTORY.read(out)
    assert (
        result["criterion_value"] == table.metadata["criterion_value"] == table.metadata["log_det"]
    )
    assert table.metadata["seed"] == 4
    assert table.metadata["config"]["design"]["harmonics"] == 2
    assert run(["design", "--evaluate", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["log_det"] == pytest.approx(result["log_det"])


def test_a_multisine_says_how_many_lines_it_has_and_which_runs_cut_a_period(tmp_path, capsys):
    config, out = tmp_path / "exoid.toml", tmp_path / "t.parquet"
    runs = "".join(
        f'[[run]]\nname = "{name}"\nrun = "exo_alone"\npurpose = "train"\nduration_s = {seconds}\n'
        for name, seconds in (("cut", 30.0), ("whole", 40.0))
    )
    config.write_text(
        f'[design]\ncriterion = "multisine"\nharmonics = 12\nbase_frequency_hz = 0.05\n{runs}'
    )
    assert run(["design", "--config", str(config), "-o", str(out)]) == 0
    captured = capsys.readouterr()
    value = TRAJECTORY.read(out).metadata["criterion_value"]
    assert " ".join(captured.out.split()).endswith(
        f"{out}: crest factor {value:.4g}, 4 odd harmonics up to 11, 2 odd and 6 even"
        " detection lines up to 12, period 20 s, seed 1; stopped by stagnation"
    )
    assert "run cut lasts 30 s, 1.5 periods" in " ".join(captured.err.split())
    assert "run whole" not in captured.err
    assert run(["design", "--config", str(config), "--evaluate", str(out)]) == 0
    assert f"crest factor {value:.4g}" in capsys.readouterr().out


def test_options_win_over_the_file(tmp_path, config):
    out = tmp_path / "t.parquet"
    options = ["--seed", "9", "--harmonics", "3", "--criterion", "condition"]
    assert run(["design", "--config", config, "-o", str(out), *options]) == 0
    metadata = TRAJECTORY.read(out).metadata
    assert (metadata["seed"], metadata["criterion"], len(metadata["a"][0])) == (9, "condition", 3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "exoid: neither -o FILE nor --evaluate FILE is given, and there is no exoid.toml in "),
        (
            ["--evaluate", "no.toml"],
            "exoid: no.toml: no such file; check the name, or make one with `exoid design`",
        ),
        (
            ["--evaluate", "no.parquet"],
            "exoid: no.parquet: no such file; check the name, or make it first",
        ),
    ],
)
def test_a_wrong_call_is_one_line_and_code_2(arguments, message, capsys):
    assert run(["design", *arguments]) == 2
    assert capsys.readouterr().err.startswith(message)


PAIR = ("base_tilt", "encoder_offset@knee")


def test_an_excitation_that_decides_between_causes_is_written_with_what_to_expect(
    tmp_path, config, capsys
):
    out = tmp_path / "next.parquet"
    assert run(["design", "--separate", *PAIR, "--config", config, "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    for title in ("With the excitation of log_det, the probability", "With this one, the probab"):
        assert title in printed
    metadata = TRAJECTORY.read(out).metadata
    assert metadata["criterion"] == "separation"
    found = metadata["separation"]
    assert [one["cause"] for one in found["rivals"]] == list(PAIR)
    odds = np.array(found["expected_log_odds"])
    assert metadata["criterion_value"] == pytest.approx(min(odds[0, 1], odds[1, 0]))
    assert np.array(found["expected_posterior"]).sum(axis=1) == pytest.approx(1.0)
    # Judged as any other excitation, it separates them as it says.
    options = ["--separate", *PAIR, "--config", config, "--json"]
    assert run(["design", "--evaluate", str(out), *options]) == 0
    judged = json.loads(capsys.readouterr().out)["separation"]
    assert np.array(judged["expected_log_odds"]) == pytest.approx(odds)


def test_a_known_effect_is_no_cause_to_separate(tmp_path, capsys):
    config = tmp_path / "exoid.toml"
    config.write_text('[diagnose]\nknown = ["rotor_inertia@knee"]\n')
    labels = ["rotor_inertia@knee", "base_tilt"]
    out = tmp_path / "next.parquet"
    options = ["--separate", *labels, "--config", str(config), "-o", str(out)]
    assert run(["design", *options]) == 2
    assert "rotor_inertia@knee is in diagnose.known" in capsys.readouterr().err


def test_a_verdict_of_another_machine_is_refused_for_that(tmp_path, monkeypatch, capsys):
    write_verdict(tmp_path, AXIS, **decision_of(AXIS))
    monkeypatch.chdir(tmp_path)
    assert run(["design", "--from", "diagnosed", "-o", "next.parquet"]) == 2
    assert "expected hip and knee" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["base_tilt"], "expected causes after --separate"),
        (["--separate", "-o", "next.parquet"], "expected causes after --separate"),
        (["--separate", *PAIR], "-o: missing"),
        (["--separate", *PAIR, "--from", "diagnosed"], "one of the three"),
        (["--separate", "base_tilt", "nonsense", "-o", "n.parquet"], "no effect 'nonsense'"),
        (["--from", "nowhere", "-o", "n.parquet"], "nowhere"),
        (["--sizes", "-o", "n.parquet"], "expected causes after --separate or --sizes"),
        (["--sizes", "cogging@knee=1"], "-o: missing"),
        (["--sizes", "--separate", *PAIR], "one of the three"),
        (["--sizes", "cogging@knee", "-o", "n.parquet"], "expected EFFECT@JOINT=SIZE"),
    ],
)
def test_a_question_that_no_excitation_answers_ends_in_one_line(
    options, message, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert run(["design", *options]) == 2
    said = capsys.readouterr().err
    assert message in said and len(said.splitlines()) == 1
    assert not list(tmp_path.glob("*.parquet"))


def leave_open(folder, effect, joint):
    """Let a verdict leave open whether the base is tilted, or another cause is there."""
    document = json.loads((folder / "verdict.json").read_text())
    tie = document["findings"][0]["causes"][0]
    document["findings"][0]["causes"] = [
        {**tie, "effect": "base_tilt", "joint": None, "probability": 0.6},
        {**tie, "effect": effect, "joint": joint, "probability": 0.3},
    ]
    document["causes"] = []
    (folder / "verdict.json").write_text(json.dumps(document))


def test_next_says_what_decides_and_writes_the_motion(tmp_path, config, capsys):
    write_verdict(tmp_path, **decision_of(ties=()))
    folder = tmp_path / "diagnosed"
    assert run(["next", str(folder), "--config", config]) == 2
    assert "leaves no choice of causes" in capsys.readouterr().err
    leave_open(folder, "rotor_inertia", "knee")
    out = tmp_path / "next.parquet"
    assert run(["next", str(folder), "--config", config, "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "Open: base tilt (0.60) or rotor inertia at the knee (0.30)." in printed
    assert all(f"\n{what} " in printed for what in ("repeat", "motion", "run", "test"))
    assert TRAJECTORY.read(out).metadata["criterion"] == "separation"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("trajectory.parquet", "the motion that the diagnosed recordings followed"),
        ("investigation/1/trajectory.parquet", "the motion that the diagnosed recordings followed"),
        ("diagnosed", "is a folder"),
        ("next.txt", "ends in .parquet"),
    ],
)
def test_next_refuses_a_place_before_it_searches(
    name, message, tmp_path, config, monkeypatch, capsys
):
    write_verdict(tmp_path, **decision_of(ties=()))
    leave_open(tmp_path / "diagnosed", "rotor_inertia", "knee")
    motion = tmp_path / "investigation" / "1" / "trajectory.parquet"
    motion.parent.mkdir(parents=True)
    motion.touch()
    monkeypatch.setattr("exoid_cli.next_.compare_experiments", None)
    words = ["next", str(tmp_path / "diagnosed"), "--config", config, "-o", str(tmp_path / name)]
    assert run(words) == 2
    said = capsys.readouterr().err
    assert message in " ".join(said.split())
    assert motion.stat().st_size == 0


def test_next_takes_the_settings_beside_the_verdict_wherever_it_is_called(
    tmp_path, config, monkeypatch
):
    write_verdict(tmp_path, **decision_of(ties=()))
    leave_open(tmp_path / "diagnosed", "rotor_inertia", "knee")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    used = []

    def compare(*given):
        used.append(given)
        raise InputError("compared")

    monkeypatch.setattr("exoid_cli.next_.compare_experiments", compare)
    assert run(["next", "../diagnosed"]) == 2
    ((_, experiment, file),) = used
    assert file.samefile(config)
    assert experiment.design.particles == 16


def test_next_says_that_it_writes_no_motion_where_none_separates_the_causes(
    tmp_path, config, capsys
):
    write_verdict(tmp_path, **decision_of(ties=()))
    folder, out = tmp_path / "diagnosed", tmp_path / "next.parquet"
    leave_open(folder, "encoder_offset", "hip")
    assert run(["next", str(folder), "--config", config, "-o", str(out)]) == 0
    assert f"{out}: not written, as no motion" in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


def test_no_excitation_is_searched_to_judge_one_for_sizes(monkeypatch):
    judged = []
    monkeypatch.setattr("exoid_cli.design.excitations", None)
    monkeypatch.setattr("exoid_cli.design.evaluate_sizes", lambda *given: judged.append(given[0]))
    assert run(["design", "--sizes", "cogging@knee=1", "--evaluate", PUBLISHED]) == 0
    assert [str(file) for file in judged] == [PUBLISHED]
