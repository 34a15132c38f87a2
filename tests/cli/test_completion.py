"""A shell that asks what may follow is told."""

import pytest

from exoid_cli.app import run
from tests.report.sessions import write_recording, write_session


@pytest.fixture
def completed(capsys, monkeypatch):
    """What bash is offered after words, the last of which has been begun."""

    def ask(words: str) -> list[str]:
        monkeypatch.setenv("_EXOID_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
        with pytest.raises(SystemExit) as stop:
            run([])
        assert stop.value.code == 0
        captured = capsys.readouterr()
        assert captured.err == ""
        return captured.out.split()

    return ask


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("exoid sim", ["simulate"]),
        ("exoid rig ", ["serve", "check"]),
        ("exoid design --criterion sc", ["scaled_condition"]),
        ("exoid show --j", ["--json"]),
        ("exoid effects stri", ["stribeck_friction"]),
        ("exoid identify --method inst", ["instrumental_variables"]),
        ("exoid export x --to m", ["mjcf", "matlab"]),
    ],
)
def test_names_are_completed(completed, words, offered):
    assert completed(words) == offered


def test_runs_and_stages_come_from_the_experiment_in_the_folder(
    completed, exoid, tmp_path, monkeypatch
):
    assert exoid("init", tmp_path / "e").code == 0
    monkeypatch.chdir(tmp_path / "e")
    assert completed("exoid acquire --run with_") == ["with_human_train", "with_human_validate"]
    assert completed("exoid run di") == ["diagnose"]
    write_session(tmp_path / "e")
    assert completed("exoid acquire --run with_") == ["with_human_train", "with_human_validate"]
    assert completed("exoid figures --only verd") == ["verdict"]
    (tmp_path / "e" / "exoid.toml").write_text("[desing]\n")
    assert completed("exoid run di") == []


def test_runs_that_were_imported_are_not_offered_to_be_recorded(completed, tmp_path, monkeypatch):
    write_recording(tmp_path, name="exo_alone_train.parquet", imported={"log": "a.csv"})
    (tmp_path / "exoid.toml").touch()
    monkeypatch.chdir(tmp_path)
    assert completed("exoid acquire --run ") == []
