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
        return {
            "time": self.time,
            "angle": self.angle,
            "velocity": self.velocity,
            "torque": self.torque,
        }


@pytest.fixture
def pendulum() -> Pendulum:
    time = np.arange(2000) / 200.0
    frequencies = 2.0 * np.pi * np.array([0.3, 0.7, 1.1])
    phases = np.outer(time, frequencies)
    angle = np.sin(phases) @ [0.5, 0.3, 0.1]
    velocity = (np.cos(phases) * frequencies) @ [0.5, 0.3, 0.1]
    acceleration = (-np.sin(phases) * frequencies**2) @ [0.5, 0.3, 0.1]
    torque = (
        0.05 * acceleration + 2.0 * np.sin(angle) + 0.1 * velocity + 0.2 * np.tanh(velocity / 0.01)
    )
    return Pendulum(time, angle, velocity, torque)


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str
    folder: Path

    @property
    def printed(self) -> str:
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

    def write(
        columns,
        name="log.csv",
        delimiter=",",
        decimal=".",
        header=True,
        before="",
        encoding="utf-8",
    ):
        lines = [delimiter.join(columns)] if header else []
        for row in zip(*columns.values(), strict=True):
            lines.append(delimiter.join(str(value).replace(".", decimal) for value in row))
        path = tmp_path / name
        path.write_text(before + "\n".join(lines) + "\n", encoding=encoding)
        return path

    return write


@pytest.fixture(params=["mcap", "sqlite3"])
def bag(request, pendulum, tmp_path):
    """A ROS 2 bag whose messages name two joints in changing order, beside another topic."""
    rosbag2, typesys = (
        pytest.importorskip("rosbags.rosbag2"),
        pytest.importorskip("rosbags.typesys"),
    )
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    types = store.types
    plugin = (
        rosbag2.StoragePlugin.MCAP if request.param == "mcap" else rosbag2.StoragePlugin.SQLITE3
    )
    with rosbag2.Writer(tmp_path / "bag", version=9, storage_plugin=plugin) as writer:
        kind = "sensor_msgs/msg/JointState"
        states = writer.add_connection("/joint_states", kind, typestore=store)
        text = writer.add_connection("/rosout_text", "std_msgs/msg/String", typestore=store)
        hello = types["std_msgs/msg/String"]("hello")
        writer.write(
            text, 1_700_000_000_000_000_000, store.serialize_cdr(hello, "std_msgs/msg/String")
        )
        rows = zip(pendulum.time, pendulum.angle, pendulum.velocity, pendulum.torque, strict=True)
        for k, (time, *values) in enumerate(rows):
            stamp = 1_700_000_000_000_000_000 + round(time * 1e9)
            header = types["std_msgs/msg/Header"](
                types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9),
                "base",
            )
            order = [0, 1] if k % 2 else [1, 0]
            arrays = [np.array([value, 9.0])[order] for value in values]
            message = types[kind](header, [["pivot", "other"][j] for j in order], *arrays)
            writer.write(states, stamp + 150_000, store.serialize_cdr(message, kind))
    return tmp_path / "bag"
