"""A pendulum whose motion is known, and ways to write it down."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from exoid_cli.app import run
from pipelines.contracts import RECORDING

MAP = """
[time]
column = "time"
unit = "s"

[[joint]]
name = "pivot"
angle = { column = "angle", unit = "rad" }
velocity = { column = "velocity", unit = "rad/s" }
torque = { column = "torque", unit = "N·m" }

[[recording]]
name = "whole"
purpose = "train"
"""


@dataclass(frozen=True)
class Pendulum:
    """A driven pendulum of 0.05 kg·m², 2 N·m of weight and friction, sampled at 200 Hz for 10 s."""

    time: NDArray
    angle: NDArray
    velocity: NDArray
    torque: NDArray

    def columns(self) -> dict[str, NDArray]:
        return {"time": self.time, "angle": self.angle, "velocity": self.velocity, "torque": self.torque}


@pytest.fixture
def pendulum() -> Pendulum:
    time = np.arange(2000) / 200.0
    frequencies = 2.0 * np.pi * np.array([0.3, 0.7, 1.1])
    phases = np.outer(time, frequencies)
    angle = np.sin(phases) @ [0.5, 0.3, 0.1]
    velocity = (np.cos(phases) * frequencies) @ [0.5, 0.3, 0.1]
    acceleration = (-np.sin(phases) * frequencies**2) @ [0.5, 0.3, 0.1]
    torque = 0.05 * acceleration + 2.0 * np.sin(angle) + 0.1 * velocity + 0.2 * np.tanh(velocity / 0.01)
    return Pendulum(time, angle, velocity, torque)


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str
    folder: Path

    @property
    def told(self) -> str:
        """What was printed, on one line whatever the terminal's width."""
        return " ".join(self.out.split())

    def recording(self, name: str = "whole"):
        return RECORDING.read(self.folder / f"{name}.parquet")


@pytest.fixture
def imported(tmp_path, capsys):
    """Import files with a map, as a user would; the recordings are below tmp_path."""

    def call(*files: Path, map_text: str = MAP, options: tuple[str, ...] = ()) -> Outcome:
        path = tmp_path / "map.toml"
        path.write_text(map_text, encoding="utf-8")
        folder = tmp_path / "recordings"
        code = run(["import", *map(str, files), "--map", str(path), "-o", str(folder), *options])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err, folder)

    return call


@pytest.fixture
def write_csv(tmp_path):
    """Write columns as text."""

    def write(columns, name="log.csv", delimiter=",", decimal=".", header=True, before="", encoding="utf-8"):
        lines = [delimiter.join(columns)] if header else []
        for row in zip(*columns.values(), strict=True):
            lines.append(delimiter.join(str(value).replace(".", decimal) for value in row))
        path = tmp_path / name
        path.write_text(before + "\n".join(lines) + "\n", encoding=encoding)
        return path

    return write
