"""Memory and time of importing a text file of ten million rows."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow as pa
import pyarrow.csv

from tests.campaigns.bench.bench_stream import exoid
from tests.campaigns.bench.report import Row, show

SAMPLES = 10_000_000
MAP = """
[time]
column = "time"
[[joint]]
name = "pivot"
angle = { column = "angle", unit = "rad" }
velocity = { column = "velocity", unit = "rad/s" }
torque = { column = "torque", unit = "N·m" }
"""


def rows(samples: int = SAMPLES) -> Iterator[Row]:
    """Measure."""
    with TemporaryDirectory() as folder:
        log, map_ = Path(folder) / "log.csv", Path(folder) / "map.toml"
        time = np.arange(samples) / 1000.0
        angle = np.round(np.sin(0.7 * time) + 0.3 * np.sin(2.1 * time), 6)
        velocity = np.round(0.7 * np.cos(0.7 * time) + 0.63 * np.cos(2.1 * time), 4)
        torque = np.round(2.0 * np.sin(angle) + 0.1 * velocity, 4)
        table = pa.table({"time": time, "angle": angle, "velocity": velocity, "torque": torque})
        pyarrow.csv.write_csv(table, log)
        map_.write_text(MAP, encoding="utf-8")
        peak, seconds = exoid("import", log, "--map", map_, "-o", folder)
        yield Row(
            f"import, {samples:,} rows of 4 columns",
            f"{peak:.0f} MiB, {seconds:.0f} s",
            wanted="2048 MiB",
        )


if __name__ == "__main__":
    show("exoid import", rows())
