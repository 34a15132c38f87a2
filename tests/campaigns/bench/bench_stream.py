"""Memory and time of filtering and identifying a recording that is longer than memory is meant to
hold."""

import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import pyarrow as pa
import pyarrow.compute as pc

from pipelines.contracts import RECORDING
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings import datasets
from pipelines.settings.rig.plant import PlantSettings
from tests.campaigns.bench.report import Row, show

SAMPLES = 10_000_000
"""14 hours at 200 Hz."""
TILE_S = 250.0

# A process of its own asks: what a child used is otherwise never less than what its parent held
# when it began.
MEASURE = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[1:]).returncode
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, file=sys.stderr)
sys.exit(code)
"""


def rows(samples: int = SAMPLES) -> Iterator[Row]:
    """Measure; the long run has somebody in it and all of a rig's sensors."""
    with TemporaryDirectory() as folder:
        recordings = write_recordings(Path(folder), samples)
        motions = [Path(folder) / "motions" / path.name for path in recordings]
        for recording, motion in zip(recordings, motions, strict=True):
            peak, seconds = exoid("filter", recording, "-o", motion)
        yield Row(
            f"filter, {samples:,} samples", f"{peak:.0f} MiB, {seconds:.0f} s", wanted="1024 MiB"
        )
        peak, seconds = exoid("identify", *motions, "-o", Path(folder) / "identified")
        yield Row(
            f"identify, {samples:,} samples", f"{peak:.0f} MiB, {seconds:.0f} s", wanted="1024 MiB"
        )


def write_recordings(folder: Path, samples: int) -> list[Path]:
    """Write two short runs of the empty machine, a short one with somebody in it, and last a long
    one."""
    paths = []
    for run, purpose, length in (
        ("exo_alone", "train", 0),
        ("exo_alone", "validate", 0),
        ("with_human", "validate", 0),
        ("with_human", "train", samples),
    ):
        trajectory = read_trajectory(datasets() / "paper" / "trajectory.toml")
        frame, metadata = record(
            Plant(PlantSettings(), run, seed=len(paths)), trajectory, TILE_S, purpose
        )
        paths.append(folder / f"{run}_{purpose}.parquet")
        write_tiled(
            paths[-1],
            pa.Table.from_pandas(frame, preserve_index=False),
            metadata,
            max(length, len(frame)),
        )
    return paths


def write_tiled(path: Path, tile: pa.Table, metadata: dict, samples: int) -> None:
    """Write a recording that repeats a shorter one, time and counter going on."""

    def tiles() -> Iterator[pa.Table]:
        for first in range(0, samples, tile.num_rows):
            later = {"time_s": first / metadata["sample_rate_hz"], "sequence": first}
            columns = {
                name: pc.add(tile[name], pa.scalar(later[name], tile[name].type))
                if name in later
                else tile[name]
                for name in tile.column_names
            }
            yield pa.table(columns).slice(0, samples - first)

    RECORDING.write_pieces(path, tiles(), metadata)


def exoid(*arguments: Sequence) -> tuple[float, float]:
    """Run one command; return the most memory it held, MiB, and the seconds it took."""
    started = time.monotonic()
    command = [
        sys.executable,
        "-c",
        MEASURE,
        sys.executable,
        "-m",
        "exoid_cli.app",
        "--quiet",
        *map(str, arguments),
    ]
    done = subprocess.run(command, check=True, stderr=subprocess.PIPE, text=True)
    return int(done.stderr.splitlines()[-1]) / 1024, time.monotonic() - started


if __name__ == "__main__":
    show("exoid filter and identify", rows())
