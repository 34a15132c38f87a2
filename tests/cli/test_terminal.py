"""What is printed fits a terminal of 80 columns, says the same without colour, and nothing where
nobody reads."""

import json
import os
import pty
import re
import subprocess
import sys
from queue import Queue

import pytest
import typer

from exoid_cli import app as application
from exoid_cli.console import Console

COLOUR = re.compile(r"\x1b\[[0-9;]*3[0-9]")


def on_a_terminal(*arguments: str, **environment: str) -> str:
    """What a command prints to a terminal, as bytes that the terminal sees."""
    here, there = pty.openpty()
    command = [sys.executable, "-m", "exoid_cli.app", *arguments]
    kept = {
        name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR")
    }
    variables = kept | {"TERM": "xterm", "COLUMNS": "80"} | environment
    subprocess.run(command, stdin=there, stdout=there, stderr=there, env=variables, check=False)
    os.close(there)
    seen = b""
    while True:
        try:
            part = os.read(here, 65536)
        except OSError:  # the end, as Linux has it
            part = b""
        if not part:
            return seen.decode()
        seen += part


def test_an_error_is_red_on_a_terminal_and_the_same_words_without_colour():
    red, plain = (
        on_a_terminal("effects", "stribek"),
        on_a_terminal("effects", "stribek", NO_COLOR="1"),
    )
    assert COLOUR.search(red)
    assert not COLOUR.search(plain)
    assert re.sub(r"\x1b\[[0-9;]*m", "", red) == re.sub(r"\x1b\[[0-9;]*m", "", plain)


def leaves(command, words=()):
    """Every command, and every command of a group."""
    for name, inner in getattr(command, "commands", {}).items():
        yield from leaves(inner, (*words, name)) if hasattr(inner, "commands") else [(*words, name)]


@pytest.mark.parametrize(
    "words", list(leaves(typer.main.get_command(application.app))), ids=" ".join
)
def test_every_command_has_an_example_and_its_json_and_quiet_within_80_columns(exoid, words):
    outcome = exoid(*words, "--help")
    assert outcome.code == 0
    assert f"exoid {' '.join(words)}" in outcome.out.partition("Example")[2]
    for option in ("--json", "--quiet"):
        assert option in outcome.out.partition("Options:")[2]
    assert max(map(len, outcome.out.splitlines())) <= 80


@pytest.mark.parametrize(
    "words", [("effects",), ("effects", "cogging"), ("status",), ("settings", "check")]
)
def test_json_is_one_document_quiet_is_nothing_and_neither_minds_where_it_stands(
    exoid, tmp_path, monkeypatch, words
):
    assert exoid("init", tmp_path / "e", "--json").code == 0
    monkeypatch.chdir(tmp_path / "e")
    before, after = exoid("--json", *words), exoid(*words, "--json")
    assert before == after
    assert json.loads(after.out)
    assert exoid("--quiet", *words).out == exoid(*words, "-q").out == ""
    assert max(map(len, exoid(*words).out.splitlines())) <= 80


def test_a_table_ends_its_lines_where_its_words_end(capsys):
    Console().table(("joint", "why"), [("hip", "a"), ("knee", "")], title="what a table is called")
    assert capsys.readouterr().out.splitlines() == [
        "what a table is called",
        "joint  why",
        "hip    a",
        "knee",
    ]


def test_a_table_too_wide_is_broken_between_words_and_in_a_path_after_a_slash(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "50")
    rows = [
        ("replay", "simulated/extended/replay-PULSES.parquet", "waits for identify, as it must")
    ]
    Console().table(("stage", "result", "why"), [*rows, ("report", "report.html", "")])
    assert capsys.readouterr().out.splitlines() == [
        "stage   result                 why",
        "replay  simulated/extended/    waits for identify,",
        "        replay-PULSES.parquet  as it must",
        "report  report.html",
    ]


def test_a_remark_is_set_in_and_broken_between_words(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "30")
    Console().note("- creep the empty joint through 0.01 to 0.3 rad/s")
    assert capsys.readouterr().out.splitlines() == [
        "  - creep the empty joint",
        "    through 0.01 to 0.3 rad/s",
    ]


def test_a_start_that_takes_long_is_explained_where_there_is_no_terminal(monkeypatch):
    printed, console = Queue(), Console()
    monkeypatch.setattr(console.err, "print", lambda text, **options: printed.put(str(text)))
    with console.starting("compiling", late_s=0.0):
        assert printed.get() == "compiling"  # for as long as it takes


def test_a_start_that_is_over_soon_needs_no_explanation(capsys):
    with Console().starting("compiling", late_s=3600.0):
        pass
    assert capsys.readouterr().err == ""
