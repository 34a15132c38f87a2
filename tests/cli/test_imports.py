"""Help, completion and the commands that only look at files import no slow library."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from exoid_cli.app import run
from pipelines.contracts import RECORDING

COMPUTING = ("numba", "scipy", "pandas", "matplotlib", "pymodbus")
"""Libraries that compute, draw or talk to a rig."""
READING = ("pyarrow", "rich")
"""Libraries that read files and print tables."""
SCRIPT = """
import sys
from exoid_cli.app import run

code = run(sys.argv[1].split())
print(code, *(name for name in sys.argv[2:] if name in sys.modules), file=sys.stderr)
"""


def imported(command: str, libraries: tuple[str, ...], folder) -> str:
    """Return the exit code of a command, and the libraries that it imported."""
    process = subprocess.run(
        [sys.executable, "-c", SCRIPT, command, *libraries],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return process.stderr.splitlines()[-1]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Start an experiment with a recording."""
    folder = tmp_path_factory.mktemp("experiment") / "e"
    assert run(["init", str(folder), "--quiet"]) == 0
    time = np.arange(10) / 100.0
    columns = ("hip_angle_rad", "hip_torque_nm", "knee_angle_rad", "knee_torque_nm")
    frame = pd.DataFrame({"time_s": time} | {name: np.sin(time) for name in columns})
    metadata = {"run": "exo_alone", "purpose": "train", "sample_rate_hz": 100.0}
    RECORDING.write(folder / "recording.parquet", frame, metadata)
    return folder


@pytest.mark.parametrize("command", ["--help", "--version", "diagnose --help", "rig --help"])
def test_help_imports_no_library_that_computes_reads_or_prints(folder, command):
    assert imported(command, (*COMPUTING, *READING, "numpy", "asyncio"), folder) == "0"


@pytest.mark.parametrize(
    "command", ["show recording.parquet", "show exoid.toml --json", "status", "settings check"]
)
def test_a_command_that_only_looks_at_files_imports_no_library_that_computes(folder, command):
    code, *libraries = imported(command, COMPUTING, folder).split()
    assert libraries == []
    assert code == ("2" if "toml" in command else "0")


def test_a_mistyped_command_line_imports_no_library_that_computes_or_reads(folder):
    assert imported("shwo", (*COMPUTING, "pyarrow", "numpy"), folder) == "2"
