"""Models to be exported, random instants, and the programs that read what was exported."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from pipelines.export import MATLAB, C
from tests.export.machines import LEG, States, machine
from tests.export.octave import computed


@pytest.fixture(scope="session")
def states() -> States:
    """200 instants at which every joint moves."""
    random = np.random.default_rng(5)
    n = 200
    speed = random.uniform(0.3, 2.5, (n, 2)) * random.choice([-1.0, 1.0], (n, 2))
    return States(
        random.uniform(0.0, 20.0, n),
        random.uniform(-1.5, 1.5, (n, 2)),
        speed,
        random.uniform(-8.0, 8.0, (n, 2)),
    )


@pytest.fixture(scope="session")
def compiled(tmp_path_factory):
    """Compile exported C as strictly as gcc can; returns a function that makes a library of models
    by stem."""
    if not shutil.which("gcc"):
        pytest.skip("gcc is not installed; `apt-get install gcc libc6-dev` brings it")

    def build(models):
        folder = tmp_path_factory.mktemp("c")
        for stem, exported in models.items():
            for suffix, text in C.write(exported, stem).items():
                (folder / f"{stem}{suffix}").write_text(text, encoding="utf-8")
        strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]
        command = [
            "gcc",
            *strict,
            "-O1",
            "-shared",
            "-fPIC",
            "-o",
            "models.so",
            *(f"{stem}.c" for stem in models),
            "-lm",
        ]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return ctypes.CDLL(str(folder / "models.so"))

    return build


@pytest.fixture(scope="session")
def in_octave(tmp_path_factory):
    """Return what exported functions give in Octave at given instants, by stem: tau, M, C, G and so
    on."""
    if not shutil.which("octave-cli"):
        pytest.skip("Octave is not installed; `apt-get install octave` brings it")

    def run(models, states, memory=0.3):
        folder: Path = tmp_path_factory.mktemp("octave")
        for stem, exported in models.items():
            (folder / f"{stem}.m").write_text(MATLAB.write(exported, stem)[".m"], encoding="utf-8")
        return computed(folder, list(models), states, memory)

    return run


@pytest.fixture(scope="session")
def leg():
    """A leg with friction and nothing else."""
    return machine(*LEG)
