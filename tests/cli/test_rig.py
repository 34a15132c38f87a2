"""``exoid rig``: serve and check."""

import io
import json
import re

import pytest

from pipelines.settings import datasets


@pytest.mark.parametrize("verb", [[], ["serve"]])
def test_a_rig_file_is_served_with_and_without_the_verb(exoid, monkeypatch, tmp_path, verb):
    asked = []
    monkeypatch.setattr(
        "pipelines.rig.server.serve_file", lambda *given, **named: asked.append(given[:2])
    )
    assert exoid("rig", *verb, tmp_path / "rig.toml", "--run", "exo_alone").code == 0
    assert asked == [(tmp_path / "rig.toml", "exo_alone")]


def test_what_is_wrong_with_a_rig_is_said_in_words_and_exit_code_3(exoid, tmp_path):
    rig = tmp_path / "rig.toml"
    text = (
        (datasets() / "rigs" / "real_time.toml")
        .read_text()
        .replace("embedded = true", "embedded = false")
    )
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


@pytest.mark.parametrize(
    ("option", "words"),
    [("--move", "or give --yes in a script"), ("--by-hand", "is not a terminal")],
)
def test_without_a_terminal_nobody_is_asked_and_nothing_moves(exoid, monkeypatch, option, words):
    monkeypatch.setattr("sys.stdin", io.StringIO("yes\n"))
    outcome = exoid("rig", "check", datasets() / "rigs" / "plain.toml", option)
    assert outcome.code == 2
    assert words in outcome.err


def test_a_rig_on_a_serial_line_has_no_port_to_be_served_at(exoid, tmp_path):
    rig, link = tmp_path / "rig.toml", tmp_path / "tty"
    text = (datasets() / "rigs" / "plain.toml").read_text()
    text = re.sub(r'^(map = ".*)$', r'\1\nline = "bus"', text, flags=re.M)
    rig.write_text(f'{text}\n[line.bus]\ntransport = "rtu"\nserial_port = "{link}"\n')
    outcome = exoid("rig", "serve", rig, "--port", 5000)
    assert (outcome.code, outcome.out) == (2, "")
    # The last line: a first start that compiles may be announced before it.
    assert (
        outcome.err.splitlines()[-1]
        == f"exoid: --port: found 5000, but the rig is on a serial line, {link}; leave it out, or"
        " give 0 for a pseudo-terminal of any name"
    )


@pytest.mark.parametrize("address", ["127.0.0.1", "127.0.0.9", "::1", "localhost"])
def test_a_rig_listens_on_loopback_without_further_ado(exoid, monkeypatch, tmp_path, address):
    asked = []
    monkeypatch.setattr(
        "pipelines.rig.server.serve_file", lambda *given, **named: asked.append(named["bind"])
    )
    outcome = exoid("rig", tmp_path / "rig.toml", "--bind", address)
    assert outcome.code == 0
    assert "Modbus" not in outcome.err
    assert asked in ([address], ["127.0.0.1"], ["::1"])


@pytest.mark.parametrize("address", ["0.0.0.0", "::", "192.168.0.5", "no.such.name.invalid"])
def test_a_rig_lets_other_computers_in_only_with_anyone_and_warns(
    exoid, monkeypatch, tmp_path, address
):
    asked = []
    monkeypatch.setattr(
        "pipelines.rig.server.serve_file", lambda *given, **named: asked.append(named["bind"])
    )
    refused = exoid("rig", tmp_path / "rig.toml", "--bind", address)
    assert (refused.code, asked) == (2, [])
    assert "Modbus has no authentication" in refused.err
    allowed = exoid("rig", tmp_path / "rig.toml", "--bind", address, "--anyone")
    assert (allowed.code, asked) == (0, [address])
    assert f"the rig listens on {address}, and Modbus has no authentication" in allowed.err


def test_a_name_is_as_safe_as_where_it_leads(exoid, monkeypatch, tmp_path):
    asked, leads = [], {"here": ["127.0.0.1", "::1"], "both": ["127.0.0.1", "192.168.0.5"]}
    monkeypatch.setattr(
        "pipelines.rig.server.serve_file", lambda *given, **named: asked.append(named["bind"])
    )
    monkeypatch.setattr(
        "socket.getaddrinfo",
        lambda name, *_, **__: [(2, 1, 6, "", (address, 0)) for address in leads[name]],
    )
    assert exoid("rig", tmp_path / "rig.toml", "--bind", "here").code == 0
    assert exoid("rig", tmp_path / "rig.toml", "--bind", "both").code == 2
    assert asked == ["127.0.0.1"]
