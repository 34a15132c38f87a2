"""The README's first screen: its commands run on its logs, and print what stands there."""

import re
import shlex
from pathlib import Path

import numpy as np

from tests.docs.test_tutorial import alike

README = Path(__file__).parents[2] / "README.md"
STIFFNESS, REST = 0.6, 0.3
"""Of the spring that is hidden, N·m/rad and rad."""


def log(name, phase):
    """Write 20 s of a driven pendulum of 0.5 kg·m² with friction and a spring."""
    time = np.arange(0.0, 20.0, 0.005)
    angle = 2.0 * np.sin(2.0 * time + phase) + 0.4 * np.sin(5.0 * time)
    velocity, acceleration = np.gradient(angle, time), np.gradient(np.gradient(angle, time), time)
    friction = 0.4 * np.tanh(velocity / 0.01) + 0.2 * velocity
    torque = 0.5 * acceleration + 3.0 * np.sin(angle) + friction + STIFFNESS * (angle - REST)
    noise = np.random.default_rng(3).standard_normal((2, len(time)))
    columns = np.column_stack([time, angle + 1e-4 * noise[0], torque + 0.05 * noise[1]])
    np.savetxt(name, columns, "%.6f", ",", header="time,position,torque", comments="")


def test_the_first_screen_shows_what_its_commands_print(exoid, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    log("run1.csv", 0.0)
    log("run2.csv", 1.0)
    text, _ = README.read_text(encoding="utf-8").split("## Install")
    head, commands, printed = re.findall(r"^```(?:text)?\n(.*?)^```", text, re.M | re.S)
    assert Path("run1.csv").read_text().startswith(head)
    for line in commands.splitlines():
        program, *arguments = shlex.split(line)
        if "recordings/*.parquet" in arguments:
            place = arguments.index("recordings/*.parquet")
            arguments[place : place + 1] = sorted(map(str, Path("recordings").glob("*.parquet")))
        outcome = exoid(*arguments)
        assert (program, outcome.code) == ("exoid", 0), outcome.err
    assert alike(printed, outcome.out), outcome.out
