"""A virtual rig that is served ends at the first signal, wherever Python happens to be."""

import signal
import subprocess
import sys

import pytest

from pipelines.settings import datasets

SERVE = """
import ctypes, signal
from exoid_cli import app
from pipelines.rig import server

real = server.serve

async def serve(rig, plant, port, announce, *more):
    def in_compiled_code(place, line):
        announce(place, line)
        ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(NUMBER))()

    await real(rig, plant, port, in_compiled_code, *more)

server.serve = serve
app.main()
"""


@pytest.mark.parametrize(
    ("number", "code", "line"),
    [(signal.SIGTERM, 143, "exoid: stopped by SIGTERM\n"), (signal.SIGINT, 0, "")],
)
def test_a_signal_that_falls_into_compiled_code_ends_the_rig_nevertheless(number, code, line):
    words = ["rig", "serve", str(datasets() / "rigs" / "plain.toml"), "--port", "0"]
    program = SERVE.replace("NUMBER", str(int(number)))
    done = subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, timeout=180
    )
    assert (done.returncode, done.stderr) == (code, line)
