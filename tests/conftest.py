"""What holds for every test, and the command line for those that use it."""

import gc
import os
import shutil
import signal
import tempfile
from dataclasses import dataclass

# Each worker has a core; threads of BLAS, for matrices as narrow as these, would only wait for it.
# Before numpy comes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from exoid_cli.app import run
from tests.once import FOLDER

# A shell lets what it starts in the background ignore Ctrl-C, and so would the programs that tests
# start and stop.
signal.signal(signal.SIGINT, signal.default_int_handler)


WAITING = {"acquisition", "faults"}
"""Folders of tests that wait for devices, in real time, for more than half of theirs."""


def pytest_configure(config):
    # Workers of pytest-xdist inherit it, and have a workerinput.
    if not hasattr(config, "workerinput"):
        os.environ[FOLDER] = tempfile.mkdtemp(prefix="exoid-tests-")
    # Else pytest-xdist begins with the files of most tests, and what takes longest comes last.
    config.option.loadscopereorder = False


def pytest_collection_modifyitems(items):
    """Begin with the files that take long, and mix those that wait for devices with the others.

    Workers then end at about the same time, and there is one that computes while another waits.
    """
    waiting = [item for item in items if WAITING & set(item.path.parts)]
    others = [item for item in items if not WAITING & set(item.path.parts)]
    place = {}
    for some in (waiting, others):
        some.sort(key=lambda item: item.get_closest_marker("long") is None)
        files = list(dict.fromkeys(item.path for item in some))
        place |= {path: k / len(files) for k, path in enumerate(files)}
    items[:] = sorted(waiting + others, key=lambda item: place[item.path])


def pytest_collection_finish():
    """Leave thousands of collected tests out of what each collection of garbage looks through."""
    gc.collect()
    gc.freeze()


def pytest_unconfigure(config):
    if not hasattr(config, "workerinput"):
        shutil.rmtree(os.environ.pop(FOLDER))


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


@pytest.fixture
def exoid(capsys, monkeypatch):
    """Run one command line in this process, on a terminal of 80 columns."""
    monkeypatch.setenv("COLUMNS", "80")

    def call(*arguments) -> Outcome:
        code = run([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call
