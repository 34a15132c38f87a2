"""What holds for every test, and the command line for those that use it."""

import os
import signal
from dataclasses import dataclass

# Each worker has a core; threads of BLAS, for matrices as narrow as these, would only wait for it.
# Before numpy comes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from exoid_cli.app import run

# A shell lets what it starts in the background ignore Ctrl-C, and so would the programs that tests
# start and stop.
signal.signal(signal.SIGINT, signal.default_int_handler)


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
