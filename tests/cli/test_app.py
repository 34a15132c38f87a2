"""Errors become one line and an exit code; help is there and quick."""

import os
import signal
import subprocess
import sys
import tomllib
from functools import partial
from pathlib import Path

import pytest
import typer

from exoid_cli import app as application
from pipelines.errors import DeviceError, ExoidError, SettingsError

COMMANDS = sorted(typer.main.get_command(application.app).commands)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(exoid, command):
    outcome = exoid(command, "--help")
    assert outcome.code == 0
    assert command in outcome.out
    assert "Example" in outcome.out or "Commands" in outcome.out
    assert max(map(len, outcome.out.splitlines())) <= 80
    assert "list[" not in outcome.out  # a word of Python's


def test_the_list_of_commands_tells_each_whole(exoid):
    assert "..." not in exoid("--help").out.partition("Commands:")[2]


@pytest.mark.parametrize(("given", "used"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")])
def test_numpy_uses_one_thread_unless_set_otherwise(given, used):
    code = (
        "import os, sys; sys.argv = ['exoid', '--help']\n"
        "from exoid_cli.__main__ import main\n"
        "try: main()\nexcept SystemExit: print(os.environ['OPENBLAS_NUM_THREADS'])"
    )
    environment = {
        name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")
    } | given
    output = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True
    ).stdout
    assert output.splitlines()[-1] == used


def test_what_python_warns_of_reaches_who_changes_exoid_and_no_user():
    code = (
        "import warnings; from exoid_cli import app; "
        "app._command_line = lambda words: warnings.warn('overflow', RuntimeWarning); app.main()"
    )

    def stderr(**more):
        environment = {
            name: value for name, value in os.environ.items() if name != "EXOID_DEBUG"
        } | more
        return subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True
        ).stderr

    assert stderr() == ""
    assert "overflow" in stderr(EXOID_DEBUG="1")


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (
            SettingsError("exoid.toml: design.seed:\nfound -1"),
            2,
            "exoid: exoid.toml: design.seed: found -1\n",
        ),
        (DeviceError("hip drive: no answer"), 3, "exoid: hip drive: no answer\n"),
        (ExoidError("a sum did not add up"), 1, "exoid: a sum did not add up\n"),
        (KeyboardInterrupt(), 130, "exoid: stopped by Ctrl-C\n"),
        (
            PermissionError(13, "Permission denied", "out.parquet"),
            2,
            (
                "exoid: out.parquet: Permission denied; you may not read or write there; change the"
                " permissions or choose another place\n"
            ),
        ),
        (
            OSError(28, "No space left on device"),
            2,
            "exoid: No space left on device; free some space and run the command again\n",
        ),
    ],
)
def test_an_error_is_one_line_and_an_exit_code(exoid, monkeypatch, error, code, line):
    def fails(command):
        raise error

    monkeypatch.setattr(application.typer.main, "get_command", fails)
    outcome = exoid("show")
    assert (outcome.code, outcome.out, outcome.err) == (code, "", line)


HALT = """
import os, sys, time
from pathlib import Path
from exoid_cli import app
from pipelines.contracts.atomic import whole_file

@app.app.command("halt")
def halt(path: Path, number: int):
    with whole_file(path) as half:
        half.write_text("half")
        os.kill(os.getpid(), number)
        time.sleep(30)

app.main()
"""


@pytest.mark.parametrize(
    ("number", "line"),
    [
        (signal.SIGINT, "exoid: stopped by Ctrl-C\n"),
        (signal.SIGTERM, "exoid: stopped by SIGTERM\n"),
        (signal.SIGHUP, "exoid: stopped by SIGHUP\n"),
        (signal.SIGQUIT, "exoid: stopped by SIGQUIT\n"),
    ],
)
def test_a_signal_in_the_middle_of_a_command_leaves_what_was_there_and_says_so_in_one_line(
    tmp_path, number, line
):
    path = tmp_path / "verdict.json"
    path.write_text("old")
    command = [sys.executable, "-c", HALT, "halt", str(path), str(int(number))]
    # Of what nohup or a script's background has ignored exoid heeds nothing: here it is as from a
    # terminal.
    heeding = partial(signal.signal, number, signal.SIG_DFL)
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=heeding)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", line)
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [
        ("verdict.json", "old")
    ]


IMPATIENT = """
import atexit, os, signal
from exoid_cli import app
from pipelines.errors import DeviceError

NUMBERS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT")]

def signals():
    for number in NUMBERS:
        os.kill(os.getpid(), number)

@app.app.command("stopped")
def stopped():
    try:
        raise DeviceError("USE THE EMERGENCY STOP: made up")
    finally:
        signals()

fail = app.console.fail
app.console.fail = lambda text: (signals(), fail(text), signals())
atexit.register(signals)
app.main()
"""


def test_what_a_device_did_is_printed_with_its_exit_code_however_many_signals_come_meanwhile():
    done = subprocess.run(
        [sys.executable, "-c", IMPATIENT, "stopped"], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (3, "exoid: USE THE EMERGENCY STOP: made up\n")


MISTAKEN = """
import asyncio, ctypes, os, signal
from exoid_cli import app
from pipelines.errors import DeviceError

def interrupt():
    os.kill(os.getpid(), signal.SIGINT)
    signal.pause()

async def request():
    interrupt()

async def several():
    await asyncio.gather(request(), asyncio.sleep(1.0))

@app.app.command("compile")
def compiles(how: str):
    if how == "importing":
        try:
            interrupt()
        except KeyboardInterrupt:
            raise ImportError("a part of it is missing")
    if how == "executing":
        exec("interrupt()")
    if how == "awaiting":
        asyncio.run(several())
    ctypes.CFUNCTYPE(None)(interrupt)()  # as LLVM calls back at the end of a compilation
    raise DeviceError("made up") if how == "moving" else RuntimeError("no compiled object yet")

app.main()
"""


@pytest.mark.parametrize(
    ("how", "code", "line"),
    [
        ("importing", 130, "exoid: stopped by Ctrl-C\n"),
        ("executing", 130, "exoid: stopped by Ctrl-C\n"),
        ("compiling", 130, "exoid: stopped by Ctrl-C\n"),
        ("awaiting", 130, "exoid: stopped by Ctrl-C\n"),
        ("moving", 3, "exoid: made up\n"),  # what a device did is true nevertheless
    ],
)
def test_what_an_import_the_compiler_or_asyncio_makes_of_ctrl_c_is_reported_as_ctrl_c(
    tmp_path, how, code, line
):
    (tmp_path / "mistaken.py").write_text(MISTAKEN)
    command = [sys.executable, "-m", "mistaken", "compile", how]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (code, "", line)


EARLY = """
import os, sys
from importlib.metadata import EntryPoint

class Impatient:
    def find_spec(self, name, *more):
        if name == "typer":
            os.kill(os.getpid(), int(sys.argv.pop()))

sys.meta_path.insert(0, Impatient())
EntryPoint("exoid", sys.argv.pop(1), "console_scripts").load()()
"""


@pytest.mark.parametrize(
    ("number", "line"),
    [
        (signal.SIGINT, "exoid: stopped by Ctrl-C\n"),
        (signal.SIGTERM, "exoid: stopped by SIGTERM\n"),
    ],
)
def test_a_signal_while_exoid_is_still_being_loaded_ends_it_in_one_line(number, line):
    settings = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    entry = settings["project"]["scripts"]["exoid"]
    command = [sys.executable, "-c", EARLY, entry, "--version", str(int(number))]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", line)


def test_a_fault_of_exoid_keeps_its_traceback_in_a_file(exoid, monkeypatch, tmp_path):
    def fails(command):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(application.typer.main, "get_command", fails)
    monkeypatch.setattr(application.tempfile, "gettempdir", lambda: str(tmp_path))
    outcome = exoid("show")
    (log,) = tmp_path.glob("exoid-*.log")
    assert outcome.code == 1
    assert (
        outcome.err
        == "exoid: exoid itself failed: ZeroDivisionError: division by zero; please report it,"
        f" with {log}\n"
    )
    assert "Traceback" in log.read_text()

    monkeypatch.setenv("EXOID_DEBUG", "1")
    assert "Traceback" in exoid("show").err


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["shw"], "exoid: shw: no such command; did you mean show?\n"),
        (["settings"], "exoid: missing command; see `exoid settings --help`\n"),
        (["show"], "exoid: FILE: missing; see `exoid show --help`\n"),
        (
            ["show", "a", "--fast"],
            "exoid: --fast: no such option; `exoid show --help` lists those there are\n",
        ),
        (
            ["filter", "--cutof-hz", "3"],
            "exoid: --cutof-hz: no such option; did you mean --cutoff-hz?\n",
        ),
        (["rig", "chek", "rig.toml"], "exoid: chek: no such command; did you mean check?\n"),
        (["export", "x"], "exoid: --to: missing; see `exoid export --help`\n"),
        (
            ["design", "--criterion", "logdet"],
            (
                "exoid: --criterion: found logdet, expected log_det, condition, scaled_condition,"
                " multisine; did you mean log_det?\n"
            ),
        ),
        (
            ["detect", "x", "--power", "2"],
            "exoid: --power: expected less than or equal to 0.999; see `exoid detect --help`\n",
        ),
        (
            ["effects", "stribek"],
            "exoid: there is no effect 'stribek'; did you mean stribeck_friction?\n",
        ),
    ],
)
def test_a_mistyped_command_line_is_one_line_too(exoid, arguments, line):
    outcome = exoid(*arguments)
    assert (outcome.code, outcome.out, outcome.err) == (2, "", line)


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["design", "--evaluate"], "excitation.toml"),
        (["recover"], "one.parquet.journal"),
        (["settings", "check"], "rig.toml"),
        (["show"], "verdict.json"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else None,
)
def test_a_mistyped_file_of_any_kind_gets_the_name_that_was_meant(exoid, tmp_path, words, meant):
    (tmp_path / meant).touch()
    outcome = exoid(*words, tmp_path / meant.replace("i", "", 1).replace("one", "onne"))
    assert (outcome.code, outcome.out) == (2, "")
    assert f"no such file; did you mean {tmp_path / meant}?" in outcome.err


def test_exoid_alone_prints_its_help(exoid):
    outcome = exoid()
    assert "Usage: exoid" in outcome.out
    assert outcome.err == ""


def test_version(exoid):
    assert exoid("--version").out == "exoid 0.1.0\n"


@pytest.mark.parametrize("words", [["effects"], ["effects", "--json"], ["--help"]], ids=" ".join)
def test_a_command_whose_output_nobody_reads_any_longer_ends_without_a_word(words):
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "exoid_cli.app", *words], stdout=writer, stderr=subprocess.PIPE
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (128 + 13, b"")
