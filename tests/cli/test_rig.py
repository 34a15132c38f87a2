"""``exoid rig``: serve and check."""

import io
import json

import pytest

from pipelines.settings import datasets


@pytest.mark.parametrize("verb", [[], ["serve"]])
def test_a_rig_file_is_served_with_and_without_the_verb(exoid, monkeypatch, tmp_path, verb):
    asked = []
    monkeypatch.setattr("pipelines.rig.server.serve_file", lambda *given, **named: asked.append(given[:2]))
    assert exoid("rig", *verb, tmp_path / "rig.toml", "--run", "exo_alone").code == 0
    assert asked == [(tmp_path / "rig.toml", "exo_alone")]


def test_what_is_wrong_with_a_rig_is_said_in_words_and_exit_code_3(exoid, tmp_path):
    rig = tmp_path / "rig.toml"
    text = (datasets() / "rigs" / "real_time.toml").read_text().replace("embedded = true", "embedded = false")
    rig.write_text(text.replace('map = "servo"', 'map = "servo"\nport = 1'))
    outcome = exoid("rig", "check", rig)
    assert outcome.code == 3
    assert "- drive hip: refuses the connection; check that the rig is on" in outcome.out
    assert outcome.err == f"exoid: {rig}: 6 things are not as the file says\n"
    assert len(json.loads(exoid("rig", "check", rig, "--json").out)["findings"]) == 6


def test_a_rig_file_that_cannot_be_used_is_exit_code_2(exoid, tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text("name = 1\n")
    assert exoid("rig", "check", rig).code == 2


@pytest.mark.parametrize(("option", "words"), [("--move", "add --yes if it is safe"), ("--by-hand", "is no terminal")])
def test_without_a_terminal_nobody_is_asked_and_nothing_moves(exoid, monkeypatch, option, words):
    monkeypatch.setattr("sys.stdin", io.StringIO("yes\n"))
    outcome = exoid("rig", "check", datasets() / "rigs" / "plain.toml", option)
    assert outcome.code == 2
    assert words in outcome.err
