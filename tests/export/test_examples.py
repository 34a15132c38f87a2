"""The examples of docs/export.md run as they stand there."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pipelines.export import MATLAB, MJCF, URDF, C

PAGE = (Path(__file__).parents[2] / "docs" / "export.md").read_text(encoding="utf-8")


def examples(language):
    found = re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)
    assert found
    return found


@pytest.fixture
def folder(tmp_path, leg):
    for format in (MJCF, URDF, MATLAB, C):
        for suffix, text in format.write(leg, "leg").items():
            (tmp_path / f"leg{suffix}").write_text(text, encoding="utf-8")
    return tmp_path


def run(command, folder):
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("library", ["mujoco", "pinocchio"])
def test_examples_in_python_run(library, folder):
    pytest.importorskip(library, reason=f"{library} is not installed; `make install` brings it")
    for example in (text for text in examples("python") if f"import {library}" in text):
        run([sys.executable, "-c", example], folder)


def test_examples_in_c_compile(folder):
    if not shutil.which("gcc"):
        pytest.skip("gcc is not installed; `apt-get install gcc libc6-dev` brings it")
    (folder / "control.c").write_text("\n".join(examples("c")), encoding="utf-8")
    run(["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-c", "control.c", "leg.c"], folder)


def test_examples_in_matlab_run(folder):
    if not shutil.which("octave-cli"):
        pytest.skip("Octave is not installed; `apt-get install octave` brings it")
    (folder / "example.m").write_text("\n".join(examples("matlab")), encoding="utf-8")
    run(["octave-cli", "--no-init-file", "--quiet", "example.m"], folder)
