"""The commands at the head of docs/import.md lead from two logs to a report, as they stand
there."""

import re
import shlex
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[2] / "docs" / "import.md"


def log(name, phase):
    """Write what a driven pendulum of 0.5 kg·m² with friction did in 20 s."""
    time = np.arange(0.0, 20.0, 0.005)
    angle = 2.0 * np.sin(2.0 * time + phase) + 0.4 * np.sin(5.0 * time)
    velocity, acceleration = np.gradient(angle, time), np.gradient(np.gradient(angle, time), time)
    torque = (
        0.5 * acceleration + 3.0 * np.sin(angle) + 0.4 * np.tanh(velocity / 0.01) + 0.2 * velocity
    )
    noise = np.random.default_rng(3).standard_normal((2, len(time)))
    columns = [time, angle + 1e-4 * noise[0], velocity, torque + 0.05 * noise[1]]
    np.savetxt(
        name,
        np.column_stack(columns),
        "%.6f",
        ",",
        header="time,position,velocity,torque",
        comments="",
    )


def test_two_logs_become_a_report(exoid, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    log("run1.csv", 0.0)
    log("run2.csv", 1.0)
    (block,) = re.findall(
        r"^```\n(exoid import.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    for line in block.splitlines():
        program, *arguments = shlex.split(line, comments=True)
        if program == "touch":
            before = exoid("run")
            assert (before.code, before.out) == (2, "")
            assert "an empty exoid.toml next to recordings/" in before.err
            Path(*arguments).touch()
            continue
        outcome = exoid(*arguments)
        assert (program, outcome.code) == ("exoid", 0), outcome.err
    assert "warning: no closed loop" in outcome.err
    assert outcome.err.count("no closed loop") == 1
    assert Path("report.html").is_file()
    assert "Everything is up to date." in exoid("status").out
