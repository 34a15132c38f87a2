"""What Windows lacks, exoid does without: an experiment is run, up to its model, with all of that
taken away.

No Windows is asked. What is taken away is what it does not have (modules, signals, waiting for
pipes, scheduling), what it forbids (removing or replacing a file that is open), and make.
"""

import os
import subprocess
import sys

import pytest

from exoid_cli.app import expand_patterns
from pipelines.contracts import PARAMETERS

LIKE_WINDOWS = """
import builtins, os, select, signal, sys, types
from pathlib import Path

def imported(name, globals=None, *rest, imports=builtins.__import__, **named):
    ours = str((globals or {}).get("__name__")).startswith(("pipelines", "exoid_cli", "__main__"))
    if ours and name in ("fcntl", "termios", "pty", "tty", "resource", "pwd", "grp"):
        raise ImportError(name)
    if ours and name == "msvcrt":
        return types.SimpleNamespace(
            LK_LOCK=1, LK_NBLCK=2, locking=lambda *arguments: locks.append(arguments)
        )
    return imports(name, globals, *rest, **named)

def refuse_open(does):
    def checked(*paths, **named):
        opened = {os.path.realpath(f"/proc/self/fd/{fd}") for fd in os.listdir("/proc/self/fd")}
        for path in paths:
            if os.path.realpath(path) in opened:
                raise PermissionError(13, "it is open", str(path))
        return does(*paths, **named)
    return checked

locks = []
builtins.__import__ = imported
for name in ("sched_setscheduler", "sched_param", "SCHED_RR"):
    delattr(os, name)
os.unlink, os.remove, os.replace = map(refuse_open, (os.unlink, os.remove, os.replace))
def no_pipes(*told): raise OSError("only sockets can be waited for")
select.select = no_pipes
# Nothing can be taken away from an enumeration, so another stands in its place.
absent = ("SIGHUP", "SIGQUIT")
present = {n: s for n, s in signal.Signals.__members__.items() if n not in absent}
hidden = types.MappingProxyType(present)
real = signal.Signals
class Signals:
    __members__ = hidden
    def __new__(cls, number): return real(number)
    def __class_getitem__(cls, name): return hidden[name]
signal.Signals = Signals
del signal.SIGHUP, signal.SIGQUIT

from exoid_cli.app import run
code = run(sys.argv[1:])
assert len(locks) == 4, "two runs lock their journals while they record and while they convert"
sys.exit(code)
"""

QUICK = """
[design]
harmonics = 2
particles = 16
iterations = 25

[acquire]
rig = "rigs/default.toml"

[[run]]
name = "a"
run = "exo_alone"
purpose = "train"
duration_s = 10.0

[[run]]
name = "b"
run = "exo_alone"
purpose = "validate"
duration_s = 10.0
seed = 1

[identify]
figures = false
"""


@pytest.mark.slow
@pytest.mark.skipif(
    not os.path.isdir("/proc/self/fd"), reason="only Linux tells which files are open"
)
def test_an_experiment_runs_without_what_windows_lacks(exoid, tmp_path):
    folder = tmp_path / "experiment"
    assert exoid("init", folder).code == 0
    (folder / "exoid.toml").write_text(QUICK)
    environment = {**os.environ, "PATH": os.path.dirname(sys.executable)}  # no make, no shell
    command = [sys.executable, "-c", LIKE_WINDOWS, "run", "identify"]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(PARAMETERS.read(folder / "identified" / "parameters.parquet").frame) == 8
    assert sorted(path.name for path in (folder / "recordings").iterdir()) == [
        "a.parquet",
        "b.parquet",
    ]


def test_patterns_are_replaced_by_the_files_that_match(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("b.csv", "a.csv"):
        (tmp_path / name).touch()
    assert expand_patterns(["import", "*.csv", "--map", "m?.toml"]) == [
        "import",
        "a.csv",
        "b.csv",
        "--map",
        "m?.toml",
    ]
